"""Results with known deviations, made of arrays alone: no worker and no FreeCAD is needed for them."""

import numpy as np
from CadSkin.result import SkinResult

#: Face order of ``Part.makeBox``: x-, x+, y-, y+, z-, z+, as (axis, side).
BOX_FACES = ((0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1))


def box_mesh(size=(60.0, 40.0, 20.0), cells=12):
    """Return points, triangles and the face of each triangle of a box, closed, outward."""
    points, triangles, faces = [], [], []
    for number, (axis, side) in enumerate(BOX_FACES, start=1):
        first, second = ((axis + 1) % 3, (axis + 2) % 3)
        u, v = np.meshgrid(np.arange(cells + 1), np.arange(cells + 1), indexing="ij")
        grid = np.zeros((cells + 1, cells + 1, 3))
        grid[..., first], grid[..., second], grid[..., axis] = u, v, side * cells
        corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
        a, b, c, d = (
            part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
        )
        two = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        if side == 0:
            two = two[:, ::-1]
        triangles.append(two + len(points) * (cells + 1) ** 2)
        points.append(grid.reshape(-1, 3))
        faces.append(np.full(len(two), number))
    merged, place = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    scaled = merged / cells * np.asarray(size)
    return scaled, place.ravel()[np.concatenate(triangles)], np.concatenate(faces).astype(np.int32)


def box_result(size=(60.0, 40.0, 20.0), cells=12, instances=2, amplitude=0.03):
    """Return a box whose face k is offset by ``amplitude * (k - 3.5) / 2.5`` and waved by a tenth of it."""
    points, triangles, faces = box_mesh(size, cells)
    levels = amplitude * (np.arange(1, 7) - 3.5) / 2.5
    deviations, displacements = [], []
    for instance in range(instances):
        wave = 0.4 * amplitude * np.sin(points @ np.array([0.21, 0.17, 0.31]) + instance)
        corner = levels[faces - 1][:, None] * (1.0 - 0.3 * instance) + wave[triangles]
        displacement = np.zeros_like(points)
        for number, (axis, side) in enumerate(BOX_FACES, start=1):
            mine = np.unique(triangles[faces == number])
            value = levels[number - 1] * (1.0 - 0.3 * instance) + wave[mine]
            displacement[mine, axis] = value if side else -value
        deviations.append(corner)
        displacements.append(displacement)
    report = {
        "instances": [
            {
                "conforming": instance == 0,
                "tolerances": [
                    {
                        "id": "T1",
                        "characteristic": "flatness",
                        "value": 0.03 + 0.01 * instance,
                        "limit": 0.05,
                        "ok": instance == 0,
                        "certified": True,
                        "reason": "",
                    },
                    {
                        "id": "T2",
                        "characteristic": "position",
                        "value": None,
                        "limit": 0.1,
                        "ok": None,
                        "certified": False,
                        "reason": "datum B has no face",
                    },
                ],
            }
            for instance in range(instances)
        ],
        "unresolved": [],
        "warnings": [],
    }
    return SkinResult(
        points=points,
        triangles=triangles.astype(np.int32),
        triangle_face=faces,
        displacement=np.array(displacements, dtype=np.float32),
        corner_deviation=np.array(deviations, dtype=np.float32),
        report=report,
    )
