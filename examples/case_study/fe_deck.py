"""The input deck of CalculiX: draw, take binder, die and pad away in turn, let the part spring back.

Physics: small elastic and large plastic strains (J2, isotropic Swift hardening), large rotations, a sheet of
C3D8I bricks between rigid tools, penalty contact without friction. The punch stands, die and binder go up.
The binder keeps a gap. A pad presses the bottom on the punch while drawing and until the tools are away.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from .fe_mesh import TOOL_NAMES, Blank, Elements, Tool, build_blank, build_tools
from .process import ARM_HALF_WIDTH, PUNCH_HALF_LENGTH, DrawingProcess, FeMesh

STRAINS = np.array([0, 0.002, 0.005, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0])
PENALTY = 1e4  # MPa/mm; stiffer contact diverged in trials
PAIRS = {"PUNCH": "INNER", "DIE": "OUTER", "BINDER": "INNER"}  # tool -> side of the sheet


def write_deck(path: Path, process: DrawingProcess, mesh: FeMesh) -> Blank:
    """Write ``path`` (.inp) and return where the blank's nodes are in it."""
    elements = Elements()
    blank = build_blank(elements, process, mesh)
    sheet = len(elements.bricks)
    tools = build_tools(elements, process, mesh)
    lines = [
        *_mesh_lines(elements, sheet),
        *_material_lines(process),
        *_set_lines(blank, tools, process),
        *_contact_lines(blank, tools),
        *_step_lines(process, mesh),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return blank


def _mesh_lines(elements: Elements, sheet: int) -> list[str]:
    nodes = [f"{i},{x:.9g},{y:.9g},{z:.9g}" for i, (x, y, z) in enumerate(elements.nodes, 1)]
    bricks = [f"{i},{','.join(map(str, corners))}" for i, corners in enumerate(elements.bricks, 1)]
    return [
        "*NODE, NSET=NALL",
        *nodes,
        "*ELEMENT, TYPE=C3D8I, ELSET=SHEET",
        *bricks[:sheet],
        "*ELEMENT, TYPE=C3D8R, ELSET=TOOLS",
        *bricks[sheet:],
    ]


def _material_lines(process: DrawingProcess) -> list[str]:
    elastic = f"{process.young:g},{process.poisson:g}"
    curve = [f"{s:.6g},{e:g}" for s, e in zip(process.flow_stress(STRAINS), STRAINS, strict=True)]
    return [
        *("*MATERIAL, NAME=STEEL", "*ELASTIC", elastic, "*PLASTIC", *curve),
        *("*MATERIAL, NAME=RIGID", "*ELASTIC", elastic),
        *("*SOLID SECTION, ELSET=SHEET, MATERIAL=STEEL", "*SOLID SECTION, ELSET=TOOLS, MATERIAL=RIGID"),
    ]


def _set_lines(blank: Blank, tools: dict[str, Tool], process: DrawingProcess) -> list[str]:
    flat = PUNCH_HALF_LENGTH - process.punch_radius - 3
    far = blank.lines[1:]
    pad = [e for (i, j, k), e in blank.bricks.items() if k == 0 and far[i] <= flat and far[j] <= flat]
    lines = _named("*NSET, NSET=SYMX", [n for (i, _, _), n in blank.nodes.items() if i == 0])
    lines += _named("*NSET, NSET=SYMY", [n for (_, j, _), n in blank.nodes.items() if j == 0])
    lines += _named("*ELSET, ELSET=PAD", pad)
    for name, tool in tools.items():
        lines += _named(f"*NSET, NSET={name}", tool.nodes)
    return lines


def _contact_lines(blank: Blank, tools: dict[str, Tool]) -> list[str]:
    lines: list[str] = []
    top = blank.layers - 1
    middle = blank.lines < ARM_HALF_WIDTH - 1e-9
    for arm in "XY":  # the middle of the cross belongs to X
        cells = [(i, j) for i, j, k in blank.bricks if k == 0 and bool(middle[j]) == (arm == "X")]
        lines += _faces(f"INNER{arm}", [blank.bricks[i, j, top] for i, j in cells], "S2")
        along = {"X": 0, "Y": 1}[arm]
        drawn = [c for c in cells if not middle[c[along]]]
        lines += _faces(f"OUTER{arm}", [blank.bricks[i, j, 0] for i, j in drawn], "S1")
    for name, tool in tools.items():
        lines += _faces(f"ON{name}", tool.bricks, "S1")
    lines += [
        "*SURFACE INTERACTION, NAME=TOUCH",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{PENALTY:g}",
    ]
    for tool in TOOL_NAMES:
        for pair in _pairs(tool):
            lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", pair]
    return lines


def _step_lines(process: DrawingProcess, mesh: FeMesh) -> list[str]:
    moving = [f"{tool}{arm}" for tool in ("DIE", "BINDER") for arm in "XY"]
    lines = ["*STEP, NLGEOM, INC=3000", "*STATIC", f"0.002,1.,1e-6,{mesh.largest_increment:g}", "*BOUNDARY"]
    lines += ["SYMX,1,1", "SYMY,2,2", "PUNCHX,1,3", "PUNCHY,1,3"]
    for name in moving:
        lines += [f"{name},1,2", f"{name},3,3,{process.depth:.9g}"]
    lines += ["*DLOAD", f"PAD,P1,{process.pad_pressure:g}", *_saved()]
    for tool in ("BINDER", "DIE"):
        lines += ["*STEP, NLGEOM, INC=500", "*STATIC", "0.02,1.,1e-7,0.2"]
        for pair in _pairs(tool):
            lines += ["*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE", pair]
        lines += _saved()
    lines += ["*STEP, NLGEOM, INC=500", "*STATIC", "0.02,1.,1e-7,0.2", "*DLOAD", "PAD,P1,1e-4", *_saved()]
    return lines


def _saved() -> list[str]:
    return ["*NODE FILE, FREQUENCY=999", "U", "*END STEP"]


def _pairs(tool: str) -> list[str]:
    """Return the contact pairs of a tool: side of the sheet, tool."""
    return [f"{PAIRS[tool]}{arm},ON{tool}{arm}" for arm in "XY"]


def _named(head: str, numbers: Iterable[int]) -> list[str]:
    numbers = [str(n) for n in numbers]
    return [head, *(",".join(numbers[i : i + 12]) for i in range(0, len(numbers), 12))]


def _faces(name: str, bricks: Iterable[int], side: str) -> list[str]:
    return [f"*SURFACE, NAME={name}", *(f"{brick},{side}" for brick in bricks)]
