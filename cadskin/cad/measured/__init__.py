"""Readers of measured data: point clouds and meshes of scanned or computed parts, QIF results (no kernel)."""

from __future__ import annotations

from cadskin.cad.measured.frd import FeResult, read_frd
from cadskin.cad.measured.points import PointCloud, read_points
from cadskin.cad.measured.qif import QifCharacteristic, QifPart, QifResults, read_qif

__all__ = [
    "FeResult",
    "PointCloud",
    "QifCharacteristic",
    "QifPart",
    "QifResults",
    "read_frd",
    "read_points",
    "read_qif",
]
