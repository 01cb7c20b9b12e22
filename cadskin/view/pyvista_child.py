"""The child process of `cadskin.view.pyvista_engine`: ``python -m ... IN.npz OUT.npy``."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

__all__ = ["main"]


def main(source: str, target: str) -> None:
    """Read a scene, draw it, write the picture (height, width, 3) uint8."""
    with np.load(source) as archive:
        scene = dict(archive)
    np.save(target, _draw(scene))


def _draw(scene: dict[str, Any]) -> Any:
    import pyvista

    width, height = (int(side) for side in scene["size"])
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[width, height])
    plotter.set_background("#fbfcfd")
    plotter.enable_anti_aliasing("ssaa")
    mesh = pyvista.PolyData.from_regular_faces(scene["points"], scene["triangles"])
    mesh.point_data["normals"] = scene["normals"]
    mesh.point_data.active_normals_name = "normals"
    mesh.point_data["colours"] = scene["colours"]
    plotter.add_mesh(mesh, scalars="colours", rgb=True, smooth_shading=True, lighting=bool(scene["lit"]))
    if len(scene["lines"]):
        ends = scene["lines"].reshape(-1, 3)
        segments = np.arange(len(ends)).reshape(-1, 2)
        lines = pyvista.PolyData(ends, lines=np.insert(segments, 0, 2, axis=1).ravel())
        plotter.add_mesh(lines, color="#20262e", line_width=1.6 * min(width / 1200, height / 900))
    camera = plotter.camera
    distance = 10 * float(scene["half_height"]) + float(np.ptp(scene["points"], axis=0).sum())
    camera.focal_point = scene["focus"]
    camera.position = scene["focus"] + distance * scene["eye"]
    camera.up = scene["up"]
    camera.parallel_projection = True
    camera.parallel_scale = float(scene["half_height"])
    plotter.reset_camera_clipping_range()
    return plotter.screenshot(return_img=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
