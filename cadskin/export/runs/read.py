"""Read a run folder lazily: nothing is loaded before it is asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from cadskin.errors import ReadError
from cadskin.export.runs.layout import NOMINAL, SPEC, read_about, sha256_of_file
from cadskin.export.runs.nominal_archive import load_nominal
from cadskin.skin.model import SkinEnsemble, SkinModel
from cadskin.skin.provenance import Provenance, nominal_sha256

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification

__all__ = ["Run", "open_run"]


@dataclass(frozen=True, eq=False)
class Run:
    """A population on disk; a sequence of `SkinModel`.

    Parameters
    ----------
    folder : Path
    about : mapping
        The content of ``run.json``.
    """

    folder: Path
    about: dict[str, Any]
    _sound: set[str] = field(default_factory=set, repr=False)

    def __len__(self) -> int:
        return sum(int(chunk["count"]) for chunk in self.about["chunks"])

    def __repr__(self) -> str:
        return f"Run({str(self.folder)!r}, {len(self)} of {self.about['size']} parts)"

    @property
    def complete(self) -> bool:
        """Whether all parts that were asked for are there."""
        return len(self) == int(self.about["size"])

    @cached_property
    def nominal(self) -> NominalModel:
        """The nominal model."""
        nominal = load_nominal(self.folder / NOMINAL)
        if nominal_sha256(nominal) != self.about["nominal_sha256"]:
            raise ReadError(f"{self.folder / NOMINAL} is not the nominal model that the run was made with")
        return nominal

    @cached_property
    def spec(self) -> Specification | None:
        """The specification, bound to the faces; None for a run without one."""
        file = self.folder / SPEC
        if self.about["spec_sha256"] is None:
            return None
        from cadskin.spec import read_spec

        if not file.is_file() or sha256_of_file(file) != self.about["spec_sha256"]:
            raise ReadError(f"{file} is not the specification that the run was made with")
        return read_spec(file)

    @property
    def tolerances(self) -> tuple[str, ...]:
        """Ids of the evaluated tolerances."""
        return tuple(item["tolerance"] for item in self.about["tolerances"])

    @cached_property
    def values(self) -> Floats:
        """Values (N, m) of the tolerances on the welded meshes [mm]."""
        parts = [self._array(chunk, "values") for chunk in self.about["chunks"]]
        return np.concatenate([np.zeros((0, len(self.tolerances))), *parts])

    @property
    def provenance(self) -> Provenance:
        """Where the parts come from."""
        return Provenance(**self.about["provenance"])

    def deviation(self, index: int) -> Floats:
        """Return the deviations of a part (n_c,) [mm]; only its chunk is read."""
        number = range(len(self))[index]
        for chunk in self.about["chunks"]:
            if number < chunk["first"] + chunk["count"]:
                return np.array(self._array(chunk, "deviations")[number - chunk["first"]])
        raise ReadError(f"{self.folder} has no part {index}")  # unreachable for a sound run.json

    @overload
    def __getitem__(self, index: int) -> SkinModel: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[SkinModel, ...]: ...
    def __getitem__(self, index: int | slice) -> SkinModel | tuple[SkinModel, ...]:
        numbers = range(len(self))[index]
        return tuple(map(self._part, numbers)) if isinstance(numbers, range) else self._part(numbers)

    def __iter__(self) -> Iterator[SkinModel]:
        return map(self._part, range(len(self)))

    def ensemble(self) -> SkinEnsemble:
        """Return all parts in memory."""
        fields_ = [self._array(chunk, "deviations") for chunk in self.about["chunks"]]
        return SkinEnsemble(
            self.nominal, np.concatenate([np.zeros((0, self.nominal.n_samples)), *fields_]), self.provenance
        )

    def _part(self, number: int) -> SkinModel:
        data = self.provenance.to_dict() | {"index": number}
        return SkinModel(self.nominal, self.deviation(number), Provenance(**data))

    def _array(self, chunk: dict[str, Any], what: str) -> Floats:
        """Map an array of a chunk into memory; its checksum is compared once."""
        file = self.folder / chunk[what]
        if chunk[what] not in self._sound:
            if not file.is_file():
                raise ReadError(f"{file} is missing; run the same command again to make it anew")
            if sha256_of_file(file) != chunk[f"{what}_sha256"]:
                raise ReadError(
                    f"{file} is damaged: its checksum differs from that in run.json; run the same command "
                    "again to make it anew"
                )
            self._sound.add(chunk[what])
        return np.asarray(np.load(file, mmap_mode="r", allow_pickle=False))


def open_run(folder: str | Path) -> Run:
    """Open a run folder.

    Parameters
    ----------
    folder : path
        What ``cadskin simulate -o`` or `cadskin.simulate_run` wrote.

    Returns
    -------
    Run
        ``len(run)``, ``run[i]``, ``run[i].deviation``, ``run.values``; parts are read when asked for.

    Raises
    ------
    ReadError
        No run folder, a damaged file, or another version.
    """
    path = Path(folder)
    return Run(path, read_about(path))
