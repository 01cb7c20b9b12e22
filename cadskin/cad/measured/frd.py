"""Read node displacements from the result files of CalculiX and CGX (.frd, text)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import ReadError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Vectors

__all__ = ["FeResult", "read_frd"]


@dataclass(frozen=True, eq=False)
class FeResult:
    """Nodes of a finite element run and where they have gone.

    Parameters
    ----------
    node_ids : (n,) int
        As in the input deck.
    points : (n, 3) float
        Before loading [mm].
    displacements : (n, 3) float
        Of the last time that the file holds [mm].
    times : (k,) float
        Times of all displacement fields in the file.
    source : str
        File name, without its folder.
    """

    node_ids: Ints
    points: Points
    displacements: Vectors
    times: Floats
    source: str = ""

    def __post_init__(self) -> None:
        """Check and freeze."""
        n = len(self.node_ids)
        object.__setattr__(
            self, "node_ids", frozen(self.node_ids, dtype=np.int64, shape=(n,), name="node_ids")
        )
        for name in ("points", "displacements"):
            object.__setattr__(self, name, frozen(getattr(self, name), shape=(n, 3), name=name))
        object.__setattr__(self, "times", frozen(self.times, shape=(None,), name="times"))

    @property
    def moved(self) -> Points:
        """(n, 3) float : the nodes after loading [mm]."""
        return self.points + self.displacements

    def __len__(self) -> int:
        return len(self.node_ids)


def read_frd(path: str | Path) -> FeResult:
    """Read nodes and the last displacement field of a CalculiX result file.

    Parameters
    ----------
    path : path
        Text file (.frd) in mm, written by ``*NODE FILE`` with ``U``.

    Returns
    -------
    FeResult

    Raises
    ------
    ReadError
        Not such a file, no displacements in it, or cut off in the middle of a field.

    References
    ----------
    CalculiX CGX manual, "Result Format": nodal point coordinate block (2C), nodal results block (100C).
    """
    file = Path(path)
    try:
        lines = iter(file.read_text(encoding="ascii", errors="replace").splitlines())
    except OSError as error:
        raise ReadError(f"{file} cannot be read: {error}") from error
    nodes: dict[int, list[float]] = {}
    moved: dict[int, list[float]] = {}
    times: list[float] = []
    time = 0.0
    for line in lines:
        if line.startswith("    2C"):
            nodes = _block(lines, file)
        elif line.startswith("  100C"):
            time = _number(line[12:24], file)
        elif line.startswith(" -4  DISP"):
            moved = _block(lines, file)
            times.append(time)
    if not nodes or not moved:
        missing = "nodes" if not nodes else "displacements (*NODE FILE with U writes them)"
        raise ReadError(f"{file.name} holds no {missing}")
    if not moved.keys() <= nodes.keys():
        raise ReadError(f"{file.name}: displacements of nodes that have no coordinates")
    ids = np.array(sorted(moved))
    return FeResult(
        ids,
        np.array([nodes[i] for i in ids]),
        np.array([moved[i] for i in ids]),
        np.array(times),
        file.name,
    )


def _block(lines: Iterator[str], file: Path) -> dict[int, list[float]]:
    """Rows `` -1``, number (10 places), three numbers (12 places each), up to the line `` -3``."""
    rows: dict[int, list[float]] = {}
    for line in lines:
        if line.startswith(" -1"):
            rows[int(_number(line[3:13], file))] = [
                _number(line[13 + 12 * c : 25 + 12 * c], file) for c in range(3)
            ]
        elif line.startswith(" -3"):
            return rows
    raise ReadError(f"{file.name} ends in the middle of a field; the run was cut off")


def _number(text: str, file: Path) -> float:
    try:
        return float(text)
    except ValueError:
        raise ReadError(f"{file.name}: {text!r} is not a number; is it a text .frd file?") from None
