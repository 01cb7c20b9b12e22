"""Hand a shape to trimesh or meshio, with its deviation and labels."""

from __future__ import annotations

from typing import Any

from cadskin.errors import MissingDependencyError
from cadskin.export.content import Shape, content_of

__all__ = ["to_meshio", "to_trimesh"]


def to_trimesh(shape: Shape) -> Any:
    """Return a `trimesh.Trimesh` [mm].

    Vertex attribute ``deviation`` [mm]; face attributes ``face_id`` and ``feature_id``; vertices and
    triangles in the order of the shape.

    Raises
    ------
    MissingDependencyError
        trimesh is not installed.
    """
    try:
        import trimesh
    except ImportError as error:
        raise MissingDependencyError('to_trimesh needs trimesh: pip install "trimesh>=4"') from error
    content = content_of(shape)
    point_data, cell_data = _fields(content)
    return trimesh.Trimesh(
        content.points.copy(),
        content.triangles.copy(),
        vertex_attributes=point_data,
        face_attributes=cell_data,
        metadata={"name": content.name, "units": "mm", "provenance": content.provenance},
        process=False,
    )


def to_meshio(shape: Shape) -> Any:
    """Return a `meshio.Mesh` [mm] with point data ``deviation`` and cell data ``face_id``, ``feature_id``.

    Raises
    ------
    MissingDependencyError
        meshio is not installed.
    """
    try:
        import meshio
    except ImportError as error:
        raise MissingDependencyError('to_meshio needs meshio: pip install "meshio>=5.3"') from error
    content = content_of(shape)
    point_data, cell_data = _fields(content)
    return meshio.Mesh(
        content.points.copy(),
        [("triangle", content.triangles.copy())],
        point_data=point_data,
        cell_data={name: [values] for name, values in cell_data.items()},
    )


def _fields(content: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    point_data, cell_data = {}, {"face_id": content.surface.face_ids.copy()}
    if content.vertex_deviation is not None:
        point_data["deviation"] = content.vertex_deviation.copy()
    if content.feature_ids is not None:
        cell_data["feature_id"] = content.feature_ids.copy()
    return point_data, cell_data
