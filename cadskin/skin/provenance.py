"""Where a skin model comes from: enough to make it again."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

import cadskin

if TYPE_CHECKING:
    from cadskin.shape import NominalModel

__all__ = ["Provenance", "nominal_sha256", "provenance_of"]


@dataclass(frozen=True)
class Provenance:
    """The record of how a skin model was made.

    Parameters
    ----------
    version : str
        Version of cadskin.
    model : str
        Text of the deviation model, or ``array`` for given numbers.
    seed : tuple of int or None
        Entropy of the seed sequence.
    spawn_key : tuple of int
        Its spawn key; the sample's own stream is ``(*spawn_key, index)``.
    index : int or None
        Number of the sample; None for a whole ensemble.
    options : mapping
        What else was asked for.
    source : mapping
        The nominal model's source: file name, SHA-256 of the file, part, edge length, mesher.
    nominal_sha256 : str
        Hash of the nominal mesh and its samples.
    """

    version: str = cadskin.__version__
    model: str = ""
    seed: tuple[int, ...] | None = None
    spawn_key: tuple[int, ...] = ()
    index: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    source: Mapping[str, Any] = field(default_factory=dict)
    nominal_sha256: str = ""

    def __post_init__(self) -> None:
        """Copy the mappings."""
        for key in ("options", "source"):
            object.__setattr__(self, key, dict(getattr(self, key)))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data (for JSON); `Provenance(**data)` makes it again."""
        return {
            "version": self.version,
            "model": self.model,
            "seed": self.seed,
            "spawn_key": self.spawn_key,
            "index": self.index,
            "options": dict(self.options),
            "source": dict(self.source),
            "nominal_sha256": self.nominal_sha256,
        }


def provenance_of(
    nominal: NominalModel,
    model: str,
    seed: np.random.SeedSequence | None,
    *,
    index: int | None = None,
    **options: Any,
) -> Provenance:
    """Return the provenance of samples of ``model`` on ``nominal``; ``options`` are kept as they are."""
    return Provenance(
        model=model,
        seed=None if seed is None else _entropy(seed),
        spawn_key=() if seed is None else tuple(int(k) for k in seed.spawn_key),
        index=index,
        options=options,
        source=asdict(nominal.source),
        nominal_sha256=nominal_sha256(nominal),
    )


def nominal_sha256(nominal: NominalModel) -> str:
    """Return a hash of the nominal mesh, its labels and its samples."""
    digest = hashlib.sha256()
    surface, samples = nominal.surface, nominal.samples
    for array in (surface.points, surface.triangles, surface.face_ids, samples.vertex_ids, samples.normals):
        digest.update(repr(array.shape).encode())
        digest.update(np.ascontiguousarray(array).data)
    digest.update(np.array([feature.stop for feature in nominal.features], dtype=np.int64).data)
    return digest.hexdigest()


def _entropy(seed: np.random.SeedSequence) -> tuple[int, ...]:
    entropy = seed.entropy
    if entropy is None:
        return ()
    return tuple(int(e) for e in np.atleast_1d(np.asarray(entropy, dtype=object)))
