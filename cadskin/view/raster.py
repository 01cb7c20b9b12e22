"""The software rasteriser: depth buffer, hidden lines, outlines, shading; no graphics library at all."""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = [
    "EDGE_SHARP",
    "EDGE_SMOOTH",
    "fill_triangles",
    "mark_outlines",
    "occlusion",
    "shade",
    "stamp_lines",
    "visible_area",
]

EDGE_SMOOTH, EDGE_SHARP = 1, 2


@njit(cache=True)
def fill_triangles(corners, triangles, depth, owner):  # type: ignore[no-untyped-def]
    """Write the nearest triangle of every pixel into ``owner`` and its depth into ``depth``.

    ``corners`` (n, 3) are ``x y depth`` in pixels, depth towards the eye. Triangles seen from behind stand
    back by two pixels, so that along a silhouette the front side wins.
    """
    height, width = depth.shape
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay, az = corners[a, 0], corners[a, 1], corners[a, 2]
        bx, by, bz = corners[b, 0], corners[b, 1], corners[b, 2]
        cx, cy, cz = corners[c, 0], corners[c, 1], corners[c, 2]
        doubled = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if doubled == 0.0:
            continue
        behind = 2.0 if doubled > 0.0 else 0.0  # y points down: counter-clockwise is negative
        inverse = 1.0 / doubled
        first_row = max(int(np.ceil(min(ay, by, cy) - 0.5)), 0)
        last_row = min(int(np.floor(max(ay, by, cy) - 0.5)), height - 1)
        first_column = max(int(np.ceil(min(ax, bx, cx) - 0.5)), 0)
        last_column = min(int(np.floor(max(ax, bx, cx) - 0.5)), width - 1)
        for row in range(first_row, last_row + 1):
            py = row + 0.5
            for column in range(first_column, last_column + 1):
                px = column + 0.5
                wb = ((px - ax) * (cy - ay) - (cx - ax) * (py - ay)) * inverse
                wc = ((bx - ax) * (py - ay) - (px - ax) * (by - ay)) * inverse
                wa = 1.0 - wb - wc
                if wa < -1e-9 or wb < -1e-9 or wc < -1e-9:
                    continue
                z = wa * az + wb * bz + wc * cz - behind
                if z > depth[row, column]:
                    depth[row, column] = z
                    owner[row, column] = t


@njit(cache=True)
def stamp_lines(ends, codes, depth, marks, radius):  # type: ignore[no-untyped-def]
    """Mark the pixels near the visible parts of lines.

    ``ends`` (k, 2, 3) are ``x y depth``. A point of a line is visible when nothing in the 3 x 3 pixels around
    it is nearer by more than two pixels: an edge is never eaten by the faces it bounds.
    """
    height, width = depth.shape
    reach = int(np.ceil(radius))
    for s in range(ends.shape[0]):
        x0, y0, z0 = ends[s, 0, 0], ends[s, 0, 1], ends[s, 0, 2]
        dx, dy, dz = ends[s, 1, 0] - x0, ends[s, 1, 1] - y0, ends[s, 1, 2] - z0
        steps = max(int(np.ceil(2.0 * max(abs(dx), abs(dy)))), 1)
        for step in range(steps + 1):
            share = step / steps
            x, y, z = x0 + share * dx, y0 + share * dy, z0 + share * dz
            column, row = int(np.floor(x)), int(np.floor(y))
            if column < 1 or row < 1 or column > width - 2 or row > height - 2:
                continue
            farthest = np.inf
            for r in range(row - 1, row + 2):
                for q in range(column - 1, column + 2):
                    farthest = min(farthest, depth[r, q])
            if z + 2.0 < farthest:
                continue
            for r in range(max(row - reach, 0), min(row + reach + 1, height)):
                for q in range(max(column - reach, 0), min(column + reach + 1, width)):
                    if (q + 0.5 - x) ** 2 + (r + 0.5 - y) ** 2 <= radius * radius and marks[r, q] < codes[s]:
                        marks[r, q] = codes[s]


@njit(cache=True)
def mark_outlines(depth, marks, reach, jump):  # type: ignore[no-untyped-def]
    """Mark the near side of silhouettes: where the depth falls by more than ``jump`` beyond its slope."""
    height, width = depth.shape
    for row in range(reach, height - reach):
        for column in range(reach, width - reach):
            z = depth[row, column]
            if z == -np.inf:
                continue
            for side in range(4):
                dr = reach * (1 - side) if side % 2 == 0 else 0
                dc = reach * (2 - side) if side % 2 == 1 else 0
                beyond, before = depth[row + dr, column + dc], depth[row - dr, column - dc]
                slope = abs(before - z) if before > -np.inf else 0.0
                if z - beyond > jump + 2.0 * slope:
                    marks[row, column] = 2
                    break


@njit(cache=True)
def visible_area(corners, triangles, owner, least_cosine):  # type: ignore[no-untyped-def]
    """Return for every triangle the true area of its visible part, from the pixels it owns [pixel²]."""
    area = np.zeros(triangles.shape[0])
    height, width = owner.shape
    for row in range(height):
        for column in range(width):
            t = owner[row, column]
            if t < 0:
                continue
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            u = corners[b] - corners[a]
            v = corners[c] - corners[a]
            nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
            cosine = abs(nz) / np.sqrt(nx * nx + ny * ny + nz * nz)
            area[t] += 1.0 / max(cosine, least_cosine)
    return area


@njit(cache=True)
def occlusion(depth, factor, reach, offsets):  # type: ignore[no-untyped-def]
    """Return how much of the sky each pixel (height / factor, width / factor) sees, 0 to 1.

    Pixels around a place hide sky as far as they stand above its tangent plane (screen-space ambient
    occlusion); ``offsets`` (j, 2) lie in the unit disc and are turned from pixel to pixel, ``reach`` is the
    radius of the disc in subpixels.
    """
    height, width = depth.shape[0] // factor, depth.shape[1] // factor
    result = np.ones((height, width))
    half = factor // 2
    for row in range(height):
        for column in range(width):
            r0, q0 = row * factor + half, column * factor + half
            z = depth[r0, q0]
            if z == -np.inf:
                continue
            slope_r = _slope(depth, r0, q0, factor, 0)
            slope_q = _slope(depth, r0, q0, 0, factor)
            turn = 2.0 * np.pi * ((row % 4) * 4 + (column * 7 + 3 * row) % 4) / 16.0
            cosine, sine = np.cos(turn), np.sin(turn)
            hidden = 0.0
            for k in range(offsets.shape[0]):
                dr = (cosine * offsets[k, 0] - sine * offsets[k, 1]) * reach
                dq = (sine * offsets[k, 0] + cosine * offsets[k, 1]) * reach
                r, q = int(np.rint(r0 + dr)), int(np.rint(q0 + dq))
                if r < 0 or q < 0 or r >= depth.shape[0] or q >= depth.shape[1] or depth[r, q] == -np.inf:
                    continue
                above = depth[r, q] - z - slope_r * (r - r0) - slope_q * (q - q0)
                distance = np.sqrt((r - r0) ** 2 + (q - q0) ** 2)
                if above > 0.08 * distance + 1.5:
                    hidden += min(above / (distance + 1.0), 1.0) / (1.0 + (above / (3.0 * reach)) ** 2)
            result[row, column] = 1.0 - hidden / offsets.shape[0]
    return result


@njit(cache=True)
def _slope(depth, row, column, dr, dq):  # type: ignore[no-untyped-def]
    """Return the slope of the depth in one direction, from the side where it is smaller."""
    step = max(dr, dq)
    height, width = depth.shape
    best = np.inf
    for sign in (-1, 1):
        r, q = row + sign * dr, column + sign * dq
        if 0 <= r < height and 0 <= q < width and depth[r, q] > -np.inf:
            slope = sign * (depth[r, q] - depth[row, column]) / step
            if abs(slope) < abs(best):
                best = slope
    return best if best < np.inf else 0.0


@njit(cache=True)
def shade(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    corners, triangles, rows, normals, place, table, owner, marks, lights, sky, background, factor
):
    """Return the linear-light picture (height / factor, width / factor, 3), and the shares of lines (..., 3).

    Each pixel of the buffers takes the colour of its triangle: ``place`` (r,) in 0..1 of ``table`` (k, 3) and
    the normal (r, 3) are interpolated between the triangle's own rows, lit by ``lights`` (j, 5: direction,
    strength, wrap; the last row's strength is the ambient light, which ``sky`` weakens). Boxes of factor x
    factor pixels become one; the picture is the mean over the pixels that no line covers.
    """
    height, width = owner.shape[0] // factor, owner.shape[1] // factor
    picture = np.zeros((height, width, 3))
    shares = np.zeros((height, width, 3))
    last = table.shape[0] - 1
    for row in range(height):
        for column in range(width):
            red, green, blue, count = 0.0, 0.0, 0.0, 0
            for r in range(row * factor, (row + 1) * factor):
                for q in range(column * factor, (column + 1) * factor):
                    mark, t = marks[r, q], owner[r, q]
                    shares[row, column, mark] += 1.0
                    if mark > 0:
                        continue
                    count += 1
                    if t < 0:
                        red += background[0]
                        green += background[1]
                        blue += background[2]
                        continue
                    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                    ax, ay = corners[a, 0], corners[a, 1]
                    ux, uy = corners[b, 0] - ax, corners[b, 1] - ay
                    vx, vy = corners[c, 0] - ax, corners[c, 1] - ay
                    px, py = q + 0.5 - ax, r + 0.5 - ay
                    inverse = 1.0 / (ux * vy - vx * uy)
                    wb = min(max((px * vy - vx * py) * inverse, 0.0), 1.0)
                    wc = min(max((ux * py - px * uy) * inverse, 0.0), 1.0 - wb)
                    wa = 1.0 - wb - wc
                    i, j, k = rows[t, 0], rows[t, 1], rows[t, 2]
                    nx = wa * normals[i, 0] + wb * normals[j, 0] + wc * normals[k, 0]
                    ny = wa * normals[i, 1] + wb * normals[j, 1] + wc * normals[k, 1]
                    nz = wa * normals[i, 2] + wb * normals[j, 2] + wc * normals[k, 2]
                    length = np.sqrt(nx * nx + ny * ny + nz * nz)
                    if length > 0.0:
                        length = (1.0 if inverse < 0.0 else -1.0) / length  # seen from inside: turn it
                    light = lights[lights.shape[0] - 1, 3]
                    for m in range(lights.shape[0] - 1):
                        facing = (nx * lights[m, 0] + ny * lights[m, 1] + nz * lights[m, 2]) * length
                        wrap = lights[m, 4]
                        light += lights[m, 3] * max((facing + wrap) / (1.0 + wrap), 0.0) ** 2
                    light *= sky[row, column]
                    at = min(max(wa * place[i] + wb * place[j] + wc * place[k], 0.0), 1.0)
                    index = int(at * last + 0.5)
                    red += light * table[index, 0]
                    green += light * table[index, 1]
                    blue += light * table[index, 2]
            if count > 0:
                picture[row, column, 0] = red / count
                picture[row, column, 1] = green / count
                picture[row, column, 2] = blue / count
    return picture, shares / (factor * factor)
