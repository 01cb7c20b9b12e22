"""The cross-shaped sheet-metal part as a CAD model, and its bottom plane (figures 4 to 7 of the paper)."""

from __future__ import annotations

import math

import cadquery as cq

import cadskin as cs

from .process import ARM_HALF_WIDTH, PUNCH_HALF_LENGTH, DrawingProcess

PAPER_POINTS, PAPER_TRIANGLES = 2392, 4550  # figure 7
BOTTOM_EDGE_LENGTH = 1.855  # mm, gives the paper's counts within 2 %


def cross_part(process: DrawingProcess | None = None) -> cq.Workplane:
    """Return the solid: two crossing hat profiles of constant thickness.

    Examples
    --------
    >>> from case_study.part import cross_part
    >>> [round(x, 3) for x in cross_part().val().BoundingBox().DiagonalLength.as_integer_ratio()][1] > 0
    True
    """
    arms = [_half_hat(process or DrawingProcess()).rotate((0, 0, 0), (0, 0, 1), 90 * k) for k in range(4)]
    solid = arms[0]
    for arm in arms[1:]:
        solid = solid.union(arm)
    return solid.clean()


def _half_hat(process: DrawingProcess) -> cq.Workplane:
    """From the middle of the cross along x: bottom, wall and flange, as wide as an arm."""
    t, rp, rd = process.thickness, process.punch_radius, process.die_radius
    wall, depth = PUNCH_HALF_LENGTH, process.depth
    end = wall + t + rd + process.flange_width
    c = math.sqrt(0.5)
    section = (
        cq.Workplane("XZ", origin=(0, ARM_HALF_WIDTH, 0))
        .moveTo(0, 0)
        .lineTo(wall - rp, 0)
        .threePointArc((wall - rp + (rp + t) * c, (rp + t) * (1 - c)), (wall + t, rp + t))
        .lineTo(wall + t, depth - rd)
        .threePointArc((wall + t + rd * (1 - c), depth - rd * (1 - c)), (wall + t + rd, depth))
        .lineTo(end, depth)
        .lineTo(end, depth + t)
        .lineTo(wall + t + rd, depth + t)
        .threePointArc((wall + t + rd - (rd + t) * c, depth + t - (rd + t) * (1 - c)), (wall, depth - rd))
        .lineTo(wall, rp + t)
        .threePointArc((wall - rp * (1 - c), t + rp * (1 - c)), (wall - rp, t))
        .lineTo(0, t)
        .close()
    )
    return section.extrude(2 * ARM_HALF_WIDTH)


def whole_part(edge_length: float = 2.5) -> cs.NominalModel:
    """Return the nominal model of the whole part."""
    return cs.nominal(cross_part(), edge_length=edge_length)


def bottom_plane(edge_length: float = BOTTOM_EDGE_LENGTH) -> cs.NominalModel:
    """Return the nominal model of the bottom plane alone: the outer face at z = 0."""
    return cs.nominal(cross_part().faces("<Z"), edge_length=edge_length, allow_open=True)
