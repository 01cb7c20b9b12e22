"""Nominal models of the parts of requests; the last ones are kept, so that they need not be meshed again."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import GeometryError
from cadskin.worker.request import Request, RequestError

if TYPE_CHECKING:
    from cadskin._typing import Progress
    from cadskin.shape import NominalModel

__all__ = ["PartMemory", "check_faces"]

_KEPT = 2
_SAME = 1e-5  # of the part's size: two versions of the kernel integrate areas alike to 1e-9


class PartMemory:
    """Meshes the part of a request, once."""

    def __init__(self) -> None:
        self._parts: OrderedDict[tuple[str, float | None, int | None], NominalModel] = OrderedDict()

    def nominal(self, request: Request, progress: Progress) -> NominalModel:
        """Return the nominal model of the part in a job folder.

        Raises
        ------
        GeometryError
            The part is not one solid, or not the one that the client means.
        """
        edge_length = request.positive("edge_length")
        n_points = request.count("n_points", 0) or None
        try:
            digest = hashlib.sha256(request.brep.read_bytes()).hexdigest()
        except OSError as error:
            raise RequestError(f"cannot read {request.brep}: {error.strerror or error}") from error
        key = (digest, edge_length, n_points)
        if key not in self._parts:
            self._parts[key] = _meshed(request, edge_length, n_points, progress)
            while len(self._parts) > _KEPT:
                self._parts.popitem(last=False)
        self._parts.move_to_end(key)
        found = self._parts[key]
        check_faces(found, request.options.get("faces") or {}, request.options.get("n_faces"))
        return found


def _meshed(
    request: Request, edge_length: float | None, n_points: int | None, progress: Progress
) -> NominalModel:
    from cadskin.cad import nominals

    models = nominals(
        request.brep,
        edge_length=edge_length,
        n_points=n_points,
        progress=progress,
        max_triangles=request.count("max_triangles", 4_000_000, least=1),
    )
    if len(models) != 1:
        raise GeometryError(
            f"the part has {len(models)} solids; a skin model is made of one: choose one body"
        )
    return models[0].with_source(part=request.text("part") or "part")


def check_faces(nominal: NominalModel, faces: Mapping[str, Any], n_faces: Any = None) -> None:
    """Refuse a part whose faces are not those that the client means: nothing is computed on a wrong face.

    Parameters
    ----------
    nominal : NominalModel
    faces : mapping
        Number of the face (``"6"`` for ``Face6``) to ``{area, centre}`` [mm², mm].
    n_faces : int, optional
        Number of faces of the client's shape.

    Raises
    ------
    GeometryError
        A face is missing or has another area or place; the message names it.
    """
    count = len(nominal.faces)
    if n_faces is not None and n_faces != count:
        raise GeometryError(
            f"the part has {count} faces for the worker and {n_faces} in FreeCAD: check its geometry"
        )
    size = float(np.ptp(nominal.surface.points, axis=0).max())
    for number, known in faces.items():
        index = int(number) - 1
        if not 0 <= index < count:
            raise GeometryError(f"Face{number} is not there: the part has Face1 to Face{count}")
        face = nominal.faces[index]
        moved = float(np.abs(np.asarray(known["centre"], dtype=float) - face.centre).max())
        if moved > _SAME * size or abs(known["area"] - face.area) > _SAME * size**2:
            raise GeometryError(
                f"Face{number} is another face for the worker than in FreeCAD (centre {moved:.3g} mm away); "
                "refine or copy the part, and pick its faces again"
            )
