"""Skin model shapes and ensembles of them: values that know their nominal model and where they come from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

from cadskin._arrays import frozen
from cadskin.shape.check import edge_table
from cadskin.skin.provenance import Provenance
from cadskin.skin.weld import WeldReport, prepare_weld, vertex_deviation, weld, weld_report

if TYPE_CHECKING:
    from pathlib import Path

    from cadskin._typing import Floats, Points, Vectors
    from cadskin.shape import DiscreteShape, Feature, FeatureRef, NominalModel

__all__ = ["SkinEnsemble", "SkinFeature", "SkinModel"]


@dataclass(frozen=True, eq=False)
class SkinFeature:
    """One feature of a skin model.

    Parameters
    ----------
    feature : Feature
        The nominal feature.
    deviation : (k,) float
        Deviation along the nominal normal at its samples [mm].
    points : (k, 3) float
        Its points on the skin model [mm].
    """

    feature: Feature
    deviation: Floats
    points: Points


@dataclass(frozen=True, eq=False)
class SkinModel:
    """A skin model shape (ISO 17450-1, discrete): a nominal model and one deviation field.

    Parameters
    ----------
    nominal : NominalModel
    deviation : (n_c,) float
        Deviation along the nominal normal at each feature sample [mm], + = material added.
    provenance : Provenance
    """

    nominal: NominalModel
    deviation: Floats
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        """Check and freeze the deviation."""
        values = frozen(self.deviation, shape=(self.nominal.n_samples,), name="deviation")
        object.__setattr__(self, "deviation", values)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.nominal, self.deviation, self.provenance)

    @cached_property
    def displacement(self) -> Vectors:
        """Displacement of each vertex (n, 3) [mm]; see `cadskin.weld`."""
        return weld(self.nominal, self.deviation)

    @cached_property
    def points(self) -> Points:
        """Vertices of the skin model (n, 3) [mm]."""
        return frozen(self.nominal.surface.points + self.displacement)

    @cached_property
    def surface(self) -> DiscreteShape:
        """The skin model as a mesh: the nominal triangles and labels on its points."""
        return self.nominal.surface.with_points(self.points)

    @cached_property
    def closed(self) -> bool:
        """True when every edge of the mesh has two triangles."""
        return bool((edge_table(self.surface.triangles).count == 2).all())

    @cached_property
    def report(self) -> WeldReport:
        """How well the weld could follow the deviation."""
        return weld_report(self.nominal, self.deviation, self.displacement)

    @property
    def realised_deviation(self) -> Floats:
        """Deviation (n_c,) [mm] that the points have along the nominal normals; see `cadskin.weld`."""
        return prepare_weld(self.nominal).realised(self.displacement)

    @property
    def vertex_deviation(self) -> Floats:
        """Deviation per vertex (n,) [mm]: the one of largest magnitude where features meet."""
        return vertex_deviation(self.nominal, self.deviation)

    def feature(self, ref: FeatureRef | None = None, /, **filters: Any) -> SkinFeature:
        """Return deviation and points of the one feature that `NominalModel.feature` selects."""
        feature = self.nominal.feature(ref, **filters)
        return SkinFeature(feature, self.deviation[feature.rows], frozen(self.points[feature.vertex_ids]))

    def save(self, path: str | Path, **options: Any) -> Path:
        """Write the mesh; the format follows from the file name (see `cadskin.export.write`)."""
        from cadskin.export import write

        return write(path, self, **options)

    def picture(self, path: str | Path, **options: Any) -> Path:
        """Draw the deviation in colours to a PNG (see `cadskin.view.picture`)."""
        from cadskin.view import picture

        return picture(path, self, **options)

    def to_trimesh(self) -> Any:
        """Return a `trimesh.Trimesh`."""
        from cadskin.export import to_trimesh

        return to_trimesh(self)

    def to_meshio(self) -> Any:
        """Return a `meshio.Mesh`."""
        from cadskin.export import to_meshio

        return to_meshio(self)

    def to_pyvista(self) -> Any:
        """Return a `pyvista.PolyData`."""
        from cadskin.view import to_pyvista

        return to_pyvista(self)

    def to_ocp(self) -> Any:
        """Return a triangulated `TopoDS_Shape`."""
        from cadskin.cad import to_ocp

        return to_ocp(self.surface)

    def __repr__(self) -> str:
        low, high = float(self.deviation.min(initial=0.0)), float(self.deviation.max(initial=0.0))
        return f"SkinModel({self.nominal!r}, deviation {low:+.4g} to {high:+.4g} mm, {self.provenance.model})"

    def _repr_html_(self) -> str:
        rows = [
            ("part", self.nominal.source.path or self.nominal.source.kind),
            ("points", f"{self.nominal.surface.n_points}"),
            ("triangles", f"{self.nominal.surface.n_triangles}"),
            ("features", f"{len(self.nominal.features)}"),
            ("deviation", _range_text(self.deviation)),
            ("realised within", f"{self.report.max_residual:.2g} mm"),
            ("model", self.provenance.model or "given"),
            ("seed", _seed_text(self.provenance)),
        ]
        return _table("SkinModel", rows)


@dataclass(frozen=True, eq=False)
class SkinEnsemble:
    """A population of skin model shapes of one nominal model; a sequence of `SkinModel`.

    Parameters
    ----------
    nominal : NominalModel
    deviations : (N, n_c) float
        One deviation field per skin model [mm].
    provenance : Provenance
        Of the whole; sample i has ``index=i``.
    """

    nominal: NominalModel
    deviations: Floats
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        """Check and freeze the deviations."""
        fields = frozen(self.deviations, shape=(None, self.nominal.n_samples), name="deviations")
        object.__setattr__(self, "deviations", fields)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.nominal, self.deviations, self.provenance)

    def __len__(self) -> int:
        return len(self.deviations)

    @overload
    def __getitem__(self, index: int) -> SkinModel: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[SkinModel, ...]: ...
    def __getitem__(self, index: int | slice) -> SkinModel | tuple[SkinModel, ...]:
        numbers = range(len(self))[index]
        return tuple(map(self._sample, numbers)) if isinstance(numbers, range) else self._sample(numbers)

    def __iter__(self) -> Iterator[SkinModel]:
        return map(self._sample, range(len(self)))

    def _sample(self, index: int) -> SkinModel:
        return SkinModel(self.nominal, self.deviations[index], replace(self.provenance, index=index))

    def __repr__(self) -> str:
        return f"SkinEnsemble({len(self)} of {self.nominal!r}, {self.provenance.model})"

    def _repr_html_(self) -> str:
        rows = [
            ("part", self.nominal.source.path or self.nominal.source.kind),
            ("skin models", f"{len(self)}"),
            ("feature samples", f"{self.nominal.n_samples}"),
            ("deviation", _range_text(self.deviations)),
            ("model", self.provenance.model or "given"),
            ("seed", _seed_text(self.provenance)),
        ]
        return _table("SkinEnsemble", rows)


def _range_text(deviation: Floats) -> str:
    if not deviation.size:
        return "none"
    return f"{deviation.min():+.4g} to {deviation.max():+.4g} mm"


def _seed_text(provenance: Provenance) -> str:
    if provenance.seed is None:
        return "none"
    text = ", ".join(str(word) for word in provenance.seed)
    return text if provenance.index is None else f"{text}, sample {provenance.index}"


def _table(caption: str, rows: list[tuple[str, str]]) -> str:
    from html import escape

    body = "".join(f"<tr><th style='text-align:left'>{k}</th><td>{escape(v)}</td></tr>" for k, v in rows)
    return f"<table><caption>{caption}</caption>{body}</table>"
