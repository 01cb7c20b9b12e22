"""The nominal model: the discrete nominal shape, its B-rep faces and its features."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import GeometryError
from cadskin.shape.discrete import DiscreteShape
from cadskin.shape.face import Face, Source
from cadskin.shape.samples import Samples

if TYPE_CHECKING:
    from pathlib import Path

    from cadskin._typing import Floats, Ints, Points, Triangles, Vectors
    from cadskin.shape.ideal import IdealSurface
    from cadskin.shape.selectors import FeatureRef

__all__ = ["Face", "Feature", "NominalModel", "Samples", "Source"]


@dataclass(frozen=True, eq=False)
class Feature:
    """One or several B-rep faces that count as one surface (two half-cylinders are one hole).

    Parameters
    ----------
    id : int
        Zero-based index of the feature.
    name : str
        ``face 3``, or ``faces 3+4``, or the name of the file.
    faces : tuple of Face
    ideal : IdealSurface
    triangle_ids : (t,) int
        Its triangles in the discrete shape.
    start, stop : int
        Its rows in `NominalModel.samples` and in every deviation field.
    """

    id: int
    name: str
    faces: tuple[Face, ...]
    ideal: IdealSurface
    triangle_ids: Ints
    start: int
    stop: int
    _surface: DiscreteShape = field(repr=False)
    _samples: Samples = field(repr=False)

    def __post_init__(self) -> None:
        """Freeze the triangle ids."""
        object.__setattr__(
            self, "triangle_ids", frozen(self.triangle_ids, dtype=np.int64, name="triangle_ids")
        )

    def __repr__(self) -> str:
        return f"Feature({self.id}, {self.name!r}, {self.kind}, {self.area:.6g} mm², {self.n_points} points)"

    @property
    def kind(self) -> str:
        """Kind of the ideal surface."""
        return self.ideal.kind

    @property
    def face_indices(self) -> tuple[int, ...]:
        """Zero-based indices of its B-rep faces."""
        return tuple(face.index for face in self.faces)

    @property
    def rows(self) -> slice:
        """Its rows in the samples and in a deviation field."""
        return slice(self.start, self.stop)

    @property
    def n_points(self) -> int:
        """Number of its samples."""
        return self.stop - self.start

    @property
    def area(self) -> float:
        """Exact area [mm²]."""
        return float(sum(face.area for face in self.faces))

    @property
    def radius(self) -> float | None:
        """Radius [mm] where the surface has one."""
        return self.faces[0].radius

    @property
    def internal(self) -> bool:
        """True for a hole: the material lies outside of the surface."""
        return self.faces[0].internal

    @property
    def vertex_ids(self) -> Ints:
        """Vertices of the discrete shape (k,)."""
        return self._samples.vertex_ids[self.rows]

    @property
    def points(self) -> Points:
        """Nominal points (k, 3) [mm]."""
        return self._surface.points[self.vertex_ids]

    @property
    def normals(self) -> Vectors:
        """Exact normals out of the material (k, 3)."""
        return self._samples.normals[self.rows]

    @property
    def curvatures(self) -> Floats:
        """Principal curvatures (k, 2) [1/mm], k1 >= k2."""
        return self._samples.curvatures[self.rows]

    @property
    def directions(self) -> Floats:
        """Principal directions (k, 2, 3)."""
        return self._samples.directions[self.rows]

    @property
    def uv(self) -> Floats:
        """Surface parameters (k, 2) of the B-rep face named by `sample_faces`."""
        return self._samples.uv[self.rows]

    @property
    def sample_faces(self) -> Ints:
        """B-rep face index of each sample (k,)."""
        return self._samples.face_ids[self.rows]

    @property
    def triangles(self) -> Triangles:
        """Triangles (t, 3) as indices into the feature's own samples (0 .. n_points-1)."""
        local = np.full(self._surface.n_points, -1, dtype=np.int64)
        local[self.vertex_ids] = np.arange(self.n_points)
        return local[self._surface.triangles[self.triangle_ids]]


@dataclass(frozen=True, eq=False)
class NominalModel:
    """The ideal part, discrete: its surface, its B-rep faces, its features and their samples.

    Made by `cadskin.nominal` (from CAD); read it, do not change it.

    Parameters
    ----------
    surface : DiscreteShape
        The nominal mesh [mm].
    faces : tuple of Face
        All B-rep faces, ``faces[i].index == i``.
    features : tuple of Feature
        Partition of the surface: every face belongs to exactly one feature.
    samples : Samples
        The rows that deviation fields refer to.
    closed : bool
        True for a solid.
    source : Source
    notes : tuple of str
        What was repaired or left out on the way (a healed shape, a face that could not be meshed well).
    failed_faces : tuple of int
        B-rep faces that could not be meshed as asked and carry a stand-in triangulation.
    """

    surface: DiscreteShape
    faces: tuple[Face, ...]
    features: tuple[Feature, ...]
    samples: Samples
    closed: bool = True
    source: Source = field(default_factory=Source)
    notes: tuple[str, ...] = ()
    failed_faces: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Check that features and samples fit together."""
        if any(face.index != i for i, face in enumerate(self.faces)):
            raise GeometryError("faces must be in the order of their index")
        stops = [feature.stop for feature in self.features]
        starts = [feature.start for feature in self.features]
        if starts != [0, *stops[:-1]][: len(starts)] or (stops and stops[-1] != len(self.samples)):
            raise GeometryError("the samples of the features do not follow each other without a gap")

    def __repr__(self) -> str:
        size = " x ".join(f"{s:.4g}" for s in np.ptp(self.surface.points, axis=0))
        return (
            f"NominalModel({self.source.part or self.source.path or self.source.kind}, {size} mm, "
            f"{len(self.faces)} faces, {len(self.features)} features, {self.surface.n_points} points, "
            f"{self.surface.n_triangles} triangles, {'closed' if self.closed else 'open'})"
        )

    @property
    def n_samples(self) -> int:
        """Number of feature samples, n_c: the length of a deviation field."""
        return len(self.samples)

    def feature(self, ref: FeatureRef | None = None, /, **filters: Any) -> Feature:
        """Return the one feature that ``ref`` and ``filters`` select.

        Parameters
        ----------
        ref : int, str, Feature or Face
            Face index, ``"#123"`` (STEP entity), name, ``">Z"`` and the like, ``"%CYLINDER"``; see
            `cadskin.shape.selectors.select`.
        **filters
            ``kind=``, ``name=``, ``colour=``, ``area=(low, high)``, ``radius=value`` or ``(low, high)``,
            ``internal=``.

        Raises
        ------
        SelectionError
            None, or more than one, matches; the message lists the candidates.
        """
        from cadskin.shape.selectors import select_one

        return select_one(self, ref, **filters)

    def select(self, ref: FeatureRef | None = None, /, **filters: Any) -> tuple[Feature, ...]:
        """Return all features that ``ref`` and ``filters`` select (at least one); see `feature`."""
        from cadskin.shape.selectors import select

        return select(self, ref, **filters)

    def feature_of(self, face_index: int) -> Feature:
        """Return the feature that B-rep face ``face_index`` belongs to."""
        for feature in self.features:
            if face_index in feature.face_indices:
                return feature
        raise GeometryError(f"the part has no face {face_index}; it has faces 0 to {len(self.faces) - 1}")

    def feature_ids(self) -> Ints:
        """Feature of every sample (n_c,)."""
        return np.repeat(
            np.arange(len(self.features)), np.array([f.n_points for f in self.features], dtype=np.int64)
        )

    @cached_property
    def corner_samples(self) -> Triangles:
        """Sample row of each triangle corner (m, 3): the mesh cut open along the features' edges."""
        corners = np.full((self.surface.n_triangles, 3), -1, dtype=np.int64)
        local = np.full(self.surface.n_points, -1, dtype=np.int64)
        for feature in self.features:
            vertices = feature.vertex_ids
            local[vertices] = np.arange(feature.start, feature.stop)
            corners[feature.triangle_ids] = local[self.surface.triangles[feature.triangle_ids]]
            local[vertices] = -1
        if corners.size and corners.min() < 0:
            raise GeometryError("a triangle corner has no feature sample: the model is inconsistent")
        return frozen(corners, dtype=np.int64)

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key != "corner_samples"}

    def with_source(self, **changes: Any) -> NominalModel:
        """Return a copy with changed provenance."""
        return replace(self, source=replace(self.source, **changes))

    def save(self, path: str | Path, **options: Any) -> Path:
        """Write the nominal mesh; the format follows from the file name (see `cadskin.export.write`)."""
        from cadskin.export import write

        return write(path, self, **options)

    def picture(self, path: str | Path, **options: Any) -> Path:
        """Draw the part, one colour per feature, to a PNG (see `cadskin.view.picture`)."""
        from cadskin.view import picture

        return picture(path, self, **options)

    def _repr_html_(self) -> str:
        rows = [
            ("points", self.surface.n_points),
            ("triangles", self.surface.n_triangles),
            ("B-rep faces", len(self.faces)),
            ("features", len(self.features)),
            ("feature samples", self.n_samples),
            ("size", " × ".join(f"{s:.6g}" for s in np.ptp(self.surface.points, axis=0)) + " mm"),
            ("closed", "yes" if self.closed else "no"),
        ]
        body = "".join(f"<tr><th style='text-align:left'>{k}</th><td>{v}</td></tr>" for k, v in rows)
        return f"<table><caption>NominalModel</caption>{body}</table>"


def build_features(
    surface: DiscreteShape,
    groups: Sequence[Sequence[int]],
    faces: Sequence[Face],
    samples: Samples,
    starts: Ints,
) -> tuple[Feature, ...]:
    """Return the features of a partition of the faces.

    Parameters
    ----------
    surface : DiscreteShape
    groups : sequence of sequence of int
        Face indices of each feature.
    faces : sequence of Face
    samples : Samples
    starts : (len(groups) + 1,) int
        First sample row of each feature, and the number of rows at the end.
    """
    order = np.argsort(surface.face_ids, kind="stable")
    bounds = np.searchsorted(surface.face_ids[order], np.arange(len(faces) + 1))

    def triangles_of(group: Sequence[int]) -> Iterator[Ints]:
        for index in group:
            yield order[bounds[index] : bounds[index + 1]]

    return tuple(
        Feature(
            id=i,
            name=_feature_name([faces[k] for k in group]),
            faces=tuple(faces[k] for k in group),
            ideal=faces[group[0]].ideal,
            triangle_ids=np.concatenate([*triangles_of(group), np.zeros(0, dtype=np.int64)]),
            start=int(starts[i]),
            stop=int(starts[i + 1]),
            _surface=surface,
            _samples=samples,
        )
        for i, group in enumerate(groups)
    )


def _feature_name(faces: Sequence[Face]) -> str:
    if faces[0].name and all(face.name == faces[0].name for face in faces):
        return faces[0].name
    indices = "+".join(str(face.index) for face in faces)
    return f"face {indices}" if len(faces) == 1 else f"faces {indices}"
