"""The files of a result: arrays for the client, a mesh, and the report."""

from __future__ import annotations

import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.shape import NominalModel
    from cadskin.skin import SkinEnsemble, SkinModel
    from cadskin.verify import Verification

__all__ = ["corner_deviation", "instance_report", "versions", "write_json", "write_skin"]

_PACKAGES = ("numpy", "scipy", "numba", "cadquery", "cadquery-ocp", "cadquery-ocp-novtk")


def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    from cadskin import __version__

    found = {"cadskin": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def corner_deviation(skin: SkinModel) -> Floats:
    """Return the deviation (m, 3) [mm] that the mesh has at each triangle corner, along the face's normal."""
    values: Floats = skin.realised_deviation[skin.nominal.corner_samples]
    return values


def write_skin(folder: Path, lot: SkinEnsemble) -> Floats:
    """Write ``skin.npz`` and ``skin.ply`` and return the deviations (size, m, 3) [mm] at the corners.

    Parameters
    ----------
    folder : Path
    lot : SkinEnsemble
        One instance at least.
    """
    surface = lot.nominal.surface
    displacement = np.zeros((len(lot), surface.n_points, 3), dtype=np.float32)
    corners = np.zeros((len(lot), surface.n_triangles, 3))
    for index, skin in enumerate(lot):
        displacement[index] = skin.displacement
        corners[index] = corner_deviation(skin)
        if index == 0:
            skin.save(folder / "skin.ply")
    np.savez(
        folder / "skin.npz",
        points=surface.points,
        triangles=surface.triangles.astype(np.int32),
        triangle_face=(surface.face_ids + 1).astype(np.int32),
        displacement=displacement,
        corner_deviation=corners.astype(np.float32),
        deviation=lot.deviations,
    )
    return corners


def instance_report(
    nominal: NominalModel, corners: Floats, verification: Verification | None, ids: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return the report of one instance.

    Parameters
    ----------
    nominal : NominalModel
    corners : (m, 3) float
        Deviation at the triangle corners [mm].
    verification : Verification, optional
    ids : tuple of str
        Order of the rows; those of the verification that are not named follow.
    """
    areas = nominal.surface.triangle_areas
    square = float((areas @ (corners**2).mean(axis=1)) / areas.sum())
    report: dict[str, Any] = {
        "min": float(corners.min()),
        "max": float(corners.max()),
        "rms": float(np.sqrt(square)),
        "conforming": None,
        "tolerances": [],
    }
    if verification is not None:
        rows = _rows(verification)
        order = {name: k for k, name in enumerate(ids)}
        rows.sort(key=lambda row: order.get(str(row["id"]), len(order)))
        report |= {"conforming": verification.conforming, "tolerances": rows}
    return report


def _rows(verification: Verification) -> list[dict[str, Any]]:
    rows = [
        {
            "id": name,
            "characteristic": found.characteristic,
            "value": found.value,
            "limit": found.limit,
            "ok": found.ok,
            "certified": found.certified,
            "reason": "; ".join(found.notes),
        }
        for name, found in verification.evaluations
    ]
    missing = [
        {
            "id": name,
            "characteristic": "",
            "value": None,
            "limit": None,
            "ok": None,
            "certified": False,
            "reason": reason,
        }
        for name, reason in verification.unresolved
    ]
    return rows + missing


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write a JSON file, complete or not at all."""
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(values, ensure_ascii=False, indent=1, allow_nan=False), encoding="utf-8")
    partial.replace(path)
