"""The optional engine and the conversion: the gateway to PyVista.

VTK ends the whole process when it finds no graphics library, so pictures are drawn in a child process.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from cadskin._typing import Floats
from cadskin.errors import MissingDependencyError
from cadskin.export.content import Shape, content_of
from cadskin.view.camera import Camera
from cadskin.view.scene import Scene

__all__ = ["render_in_child", "to_pyvista"]

_INSTALL = 'pip install "cadskin[view]"'
_TIME_LIMIT = 180.0  # seconds


def to_pyvista(shape: Shape) -> Any:
    """Return a `pyvista.PolyData` [mm]: point data ``deviation``, cell data ``face_id`` and ``feature_id``.

    Raises
    ------
    MissingDependencyError
        PyVista, or a system library it needs, is missing.
    """
    try:
        import pyvista
    except ImportError as error:
        raise MissingDependencyError(f"to_pyvista needs pyvista ({error}): {_INSTALL}") from error
    content = content_of(shape)
    triangles: Any = content.triangles
    mesh = pyvista.PolyData.from_regular_faces(content.points.copy(), triangles)
    if content.vertex_deviation is not None:
        mesh.point_data["deviation"] = content.vertex_deviation
    mesh.cell_data["face_id"] = content.surface.face_ids
    if content.feature_ids is not None:
        mesh.cell_data["feature_id"] = content.feature_ids
    return mesh


def render_in_child(
    scene: Scene,
    camera: Camera,
    size: tuple[int, int],
    *,
    edges: bool = True,
    lit: bool = True,
    time_limit: float = _TIME_LIMIT,
) -> Floats:
    """Return the picture (height, width, 3) of a scene as PyVista draws it, sRGB in 0..1.

    Raises
    ------
    MissingDependencyError
        PyVista is not installed, or VTK cannot draw off screen here; the message says what to install.
    """
    if importlib.util.find_spec("pyvista") is None:
        raise MissingDependencyError(
            f"engine='pyvista' needs pyvista: {_INSTALL}, or use engine='software', which needs nothing"
        )
    with tempfile.TemporaryDirectory(prefix="cadskin-view-") as folder:
        source, target = Path(folder, "scene.npz"), Path(folder, "picture.npy")
        np.savez(source, **_arrays(scene, camera, size, edges=edges, lit=lit))
        command = [sys.executable, "-m", "cadskin.view.pyvista_child", str(source), str(target)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=time_limit, check=False)
        except subprocess.TimeoutExpired as error:
            raise MissingDependencyError(_advice(f"no picture after {time_limit:g} s")) from error
        if done.returncode != 0 or not target.exists():
            lines = done.stderr.strip().splitlines() or ["no message"]
            raise MissingDependencyError(_advice(f"exit code {done.returncode}: {lines[-1]}"))
        return np.asarray(np.load(target), dtype=np.float64) / 255


def _arrays(scene: Scene, camera: Camera, size: tuple[int, int], *, edges: bool, lit: bool) -> dict[str, Any]:
    """Return what the child needs; wedges become separate points, so that colours stop at sharp edges."""
    vertex_of_row = np.zeros(len(scene.normals), dtype=np.int64)
    vertex_of_row[scene.rows] = scene.triangles
    last = len(scene.table) - 1
    index = np.round(np.clip(scene.place, 0, 1) * last).astype(np.int64)
    right, up, eye = camera.axes
    middle = (
        camera.centre
        + (size[0] / 2 - camera.middle[0]) / camera.scale * right
        + (camera.middle[1] - size[1] / 2) / camera.scale * up
    )
    return {
        "points": scene.points[vertex_of_row],
        "triangles": scene.rows,
        "normals": scene.normals,
        "colours": np.round(scene.table[index] * 255).astype(np.uint8),
        "lines": scene.points[scene.edges] if edges else np.zeros((0, 2, 3)),
        "size": np.array(size),
        "focus": middle,
        "eye": eye,
        "up": up,
        "half_height": np.array(size[1] / 2 / camera.scale),
        "lit": np.array(lit),
    }


def _advice(what: str) -> str:
    return (
        f"engine='pyvista' could not draw off screen ({what}); install the system's OpenGL libraries "
        "(Debian, Ubuntu: apt install libgl1 libegl1), or use engine='software', which needs nothing"
    )
