"""Elements of a quarter of the blank and of the rigid tools around it.

The blank is a cross of brick elements on a tensor grid, finer where the sheet passes over a radius. A tool is
one layer of brick elements behind the polyline of its profile; all their nodes are prescribed: it is rigid.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from .process import ARM_HALF_WIDTH, PUNCH_HALF_LENGTH, DrawingProcess, FeMesh

TOOL_NAMES = ("PUNCH", "DIE", "BINDER")
WALL_MARGIN = 8.0  # how far the punch reaches above the flange


@dataclass
class Elements:
    """A mesh that grows: nodes, elements and their names are 1-based as in the input deck."""

    nodes: list[tuple[float, float, float]] = field(default_factory=list)
    bricks: list[list[int]] = field(default_factory=list)

    def node(self, x: float, y: float, z: float) -> int:
        """Add a node and return its number."""
        self.nodes.append((float(x), float(y), float(z)))
        return len(self.nodes)

    def brick(self, corners: list[int]) -> int:
        """Add a brick, turned so that its volume is positive, and return its number."""
        a, b, d, e = (np.array(self.nodes[corners[i] - 1]) for i in (0, 1, 3, 4))
        if np.dot(np.cross(b - a, d - a), e - a) < 0:
            corners = [corners[i] for i in (0, 3, 2, 1, 4, 7, 6, 5)]
        self.bricks.append(corners)
        return len(self.bricks)


@dataclass(frozen=True)
class Blank:
    """Numbers of the blank's nodes and elements by their place in the grid (i along x, j along y, k up)."""

    lines: np.ndarray  # (g,) grid lines along x and y, mm
    layers: int
    nodes: dict[tuple[int, int, int], int]
    bricks: dict[tuple[int, int, int], int]


@dataclass(frozen=True)
class Tool:
    """One rigid tool along one arm: all its nodes, and its elements (face S1 looks at the sheet)."""

    nodes: list[int]
    bricks: list[int]


def grid_lines(process: DrawingProcess, mesh: FeMesh) -> np.ndarray:
    """Return the grid lines along an arm: middle of the cross, flat, then bends, wall and flange."""
    bend = PUNCH_HALF_LENGTH - process.punch_radius - 4
    parts = [
        (0.0, ARM_HALF_WIDTH, mesh.arm_length),
        (ARM_HALF_WIDTH, bend, mesh.flat_length),
        (bend, process.blank_half_length, mesh.bend_length),
    ]
    lines = [np.linspace(a, b, max(1, round((b - a) / size)) + 1) for a, b, size in parts]
    return np.concatenate([lines[0], lines[1][1:], lines[2][1:]])


def build_blank(into: Elements, process: DrawingProcess, mesh: FeMesh) -> Blank:
    """Add the blank: a cross of bricks between z = 0 and the thickness."""
    lines = grid_lines(process, mesh)
    inside = lines[1:] <= ARM_HALF_WIDTH + 1e-9  # cells by their far line
    heights = np.linspace(0, process.thickness, mesh.layers + 1)
    nodes: dict[tuple[int, int, int], int] = {}
    bricks: dict[tuple[int, int, int], int] = {}

    def at(i: int, j: int, k: int) -> int:
        if (i, j, k) not in nodes:
            nodes[i, j, k] = into.node(lines[i], lines[j], heights[k])
        return nodes[i, j, k]

    for i, j in zip(*np.nonzero(inside[:, None] | inside[None, :]), strict=True):
        i, j = int(i), int(j)
        corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        for k in range(mesh.layers):
            bricks[i, j, k] = into.brick([at(*c, k) for c in corners] + [at(*c, k + 1) for c in corners])
    return Blank(lines, mesh.layers, nodes, bricks)


def build_tools(into: Elements, process: DrawingProcess, mesh: FeMesh) -> dict[str, Tool]:
    """Add punch, die and binder along both arms; the names end with X or Y."""
    profiles = tool_profiles(process, mesh.arc_segments)
    tools = {}
    for arm in "XY":
        for name in TOOL_NAMES:
            profile = profiles[name]
            if name == "PUNCH":  # one punch serves both arms: the middle of the cross belongs to X
                start = -2.0 if arm == "X" else ARM_HALF_WIDTH - 2
                profile = np.vstack([[[start, process.thickness]], profile])
            tools[name + arm] = _extruded(into, _densified(profile, 4.0), arm, outward_down=name == "DIE")
    return tools


def tool_profiles(process: DrawingProcess, segments: int) -> dict[str, np.ndarray]:
    """Return the polylines (s, z) of punch, die and binder in the plane along an arm, before drawing."""
    t, rp, rd = process.thickness, process.punch_radius, process.die_radius
    end = process.blank_half_length + 5
    wall = PUNCH_HALF_LENGTH + process.clearance * t
    gap = process.binder_gap * t
    punch = np.vstack(
        [
            _arc((PUNCH_HALF_LENGTH - rp, t + rp), rp, (-90, 0), segments),
            [[PUNCH_HALF_LENGTH, t + rp + process.depth + WALL_MARGIN]],
        ]
    )
    die = np.vstack(
        [
            [[wall, -rd - process.depth - 5]],
            _arc((wall + rd, -rd), rd, (180, 90), segments),
            [[end, 0.0]],
        ]
    )
    return {"PUNCH": punch, "DIE": die, "BINDER": np.array([[wall + rd / 2, gap], [end, gap]])}


def _arc(
    centre: tuple[float, float], radius: float, degrees: tuple[float, float], segments: int
) -> np.ndarray:
    angles = np.radians(np.linspace(*degrees, segments + 1))
    return np.asarray(centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _densified(line: np.ndarray, length: float) -> np.ndarray:
    """Split segments longer than ``length``."""
    parts = [line[:1]]
    for a, b in pairwise(line):
        pieces = max(1, int(np.ceil(np.linalg.norm(b - a) / length)))
        parts.append(a + (b - a) * np.arange(1, pieces + 1)[:, None] / pieces)
    return np.vstack(parts)


def _extruded(into: Elements, profile: np.ndarray, arm: str, *, outward_down: bool) -> Tool:
    """Add a layer of bricks behind a profile, across the arm."""
    tangent = np.gradient(profile, axis=0)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    flat = -1 if outward_down else 0  # the end of the profile that is level
    behind_is_up = not outward_down
    sign = 1.0 if (normal[flat, 1] > 0) == behind_is_up else -1.0
    back = profile + 0.5 * sign * normal
    across = np.array([-1, ARM_HALF_WIDTH + 1])

    def layer(points: np.ndarray) -> list[list[int]]:
        order = (lambda s, w, z: (s, w, z)) if arm == "X" else (lambda s, w, z: (w, s, z))
        return [[into.node(*order(s, w, z)) for w in across] for s, z in points]

    front, rear = layer(profile), layer(back)
    bricks = []
    for i in range(len(profile) - 1):
        for j in range(len(across) - 1):
            ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            bricks.append(into.brick([front[a][b] for a, b in ring] + [rear[a][b] for a, b in ring]))
    return Tool(sorted(n for rows in (front, rear) for row in rows for n in row), bricks)
