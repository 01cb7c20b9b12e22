"""Exact areas, centres and volumes of B-rep shapes, to measure meshes against."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps

from cadskin._typing import Floats
from cadskin.cad._occ import xyz

__all__ = ["box_diagonal", "face_properties", "shape_volume"]


def face_properties(faces: Any) -> tuple[Floats, Floats]:
    """Return the areas (f,) [mm²] and centres of area (f, 3) [mm] of faces."""
    areas, centres = np.zeros(len(faces)), np.zeros((len(faces), 3))
    for index, face in enumerate(faces):
        properties = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, properties)
        areas[index] = abs(properties.Mass())
        centres[index] = xyz(properties.CentreOfMass())
    return np.nan_to_num(areas, nan=0.0, posinf=0.0), np.nan_to_num(centres)


def shape_volume(shape: Any) -> float:
    """Return the signed volume of a shape [mm³]."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return float(properties.Mass())


def box_diagonal(shape: Any) -> float:
    """Return the diagonal [mm] of the bounding box of a shape, 0 for a void one."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        return 0.0
    low, high = np.array(xyz(box.CornerMin())), np.array(xyz(box.CornerMax()))
    return float(np.linalg.norm(high - low))
