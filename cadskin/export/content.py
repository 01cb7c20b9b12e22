"""What a file can hold of a shape: one plain record for all formats."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeAlias, runtime_checkable

import numpy as np

from cadskin._typing import Floats, Ints, Points, Triangles, Vectors
from cadskin.errors import GeometryError
from cadskin.shape import DiscreteShape, NominalModel, vertex_normals

__all__ = ["Content", "Shape", "SkinLike", "content_of"]


@runtime_checkable
class SkinLike(Protocol):
    """The part of `cadskin.SkinModel` that files and pictures need."""

    @property
    def nominal(self) -> NominalModel:
        """The ideal part."""

    @property
    def surface(self) -> DiscreteShape:
        """The deviated mesh [mm]."""

    @property
    def deviation(self) -> Floats:
        """Deviation of every feature sample (n_c,) [mm]."""

    @property
    def vertex_deviation(self) -> Floats:
        """Deviation of every vertex (n,) [mm]."""


Shape: TypeAlias = NominalModel | DiscreteShape | SkinLike


@dataclass(frozen=True, eq=False)
class Content:
    """Everything a writer may put into its file.

    Parameters
    ----------
    surface : DiscreteShape
        The mesh [mm].
    name : str
        Name of the part, for headers.
    face_names : tuple of str
        One per B-rep face.
    nominal : NominalModel or None
        With its samples; None for a bare discrete shape.
    feature_ids : (m,) int or None
        Feature of each triangle.
    vertex_deviation : (n,) float or None
        Deviation of each vertex [mm]; None where the shape is ideal.
    deviation : (n_c,) float or None
        Deviation of each feature sample [mm].
    provenance : dict
        Plain JSON values.
    """

    surface: DiscreteShape
    name: str = "part"
    face_names: tuple[str, ...] = ()
    nominal: NominalModel | None = None
    feature_ids: Ints | None = None
    vertex_deviation: Floats | None = None
    deviation: Floats | None = None
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def points(self) -> Points:
        """Vertices (n, 3) [mm]."""
        return self.surface.points

    @property
    def triangles(self) -> Triangles:
        """Triangles (m, 3)."""
        return self.surface.triangles

    def normals(self) -> Vectors:
        """Area-weighted unit normals of the vertices (n, 3)."""
        return vertex_normals(self.surface.points, self.surface.triangles)

    def header(self) -> list[str]:
        """Return comment lines, plain ASCII, for formats that have comments."""
        lines = [self.provenance["generator"], f"part {self.name}", "unit mm"]
        return ["".join(c if " " <= c <= "~" else "?" for c in line) for line in lines]


def content_of(shape: Shape) -> Content:
    """Collect what files can hold of ``shape``.

    Parameters
    ----------
    shape : NominalModel, SkinModel or DiscreteShape

    Raises
    ------
    GeometryError
        Not a shape, or one without triangles.
    """
    if isinstance(shape, DiscreteShape):
        content = _of_discrete(shape)
    elif isinstance(shape, NominalModel):
        content = _of_nominal(shape)
    elif isinstance(shape, SkinLike):
        content = dataclasses.replace(
            _of_nominal(shape.nominal),
            surface=shape.surface,
            vertex_deviation=np.asarray(shape.vertex_deviation, dtype=np.float64),
            deviation=np.asarray(shape.deviation, dtype=np.float64),
        )
        content.provenance["skin"] = _plain(getattr(shape, "provenance", None) or {})
    else:
        raise GeometryError(
            f"a {type(shape).__name__} has no mesh; give a NominalModel, a SkinModel or a DiscreteShape"
        )
    if not content.surface.n_triangles:
        raise GeometryError("the shape has no triangles, there is nothing to write")
    return content


def _of_discrete(surface: DiscreteShape) -> Content:
    n_faces = int(surface.face_ids.max(initial=-1)) + 1
    names = tuple(f"face {i}" for i in range(n_faces))
    return Content(surface, face_names=names, provenance=_origin())


def _of_nominal(nominal: NominalModel) -> Content:
    feature_ids = np.full(nominal.surface.n_triangles, -1, dtype=np.int64)
    for feature in nominal.features:
        feature_ids[feature.triangle_ids] = feature.id
    source = nominal.source
    return Content(
        nominal.surface,
        name=source.part or source.path or "part",
        face_names=tuple(face.name or f"face {face.index}" for face in nominal.faces),
        nominal=nominal,
        feature_ids=feature_ids,
        provenance=_origin() | {"source": _plain(source)},
    )


def _origin() -> dict[str, Any]:
    from cadskin import __version__

    return {"generator": f"cadskin {__version__}", "unit": "mm"}


def _plain(value: Any) -> Any:
    """Return ``value`` with JSON types only; what JSON does not know becomes its text."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = dataclasses.asdict(value)
    if isinstance(value, Mapping):
        value = dict(value)
    return json.loads(json.dumps(value, default=str))
