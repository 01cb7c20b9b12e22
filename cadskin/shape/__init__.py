"""The nominal discrete shape, its features and the operations of ISO 17450 (numpy and scipy only)."""

from __future__ import annotations

from cadskin.shape.discrete import DiscreteShape, triangle_normals, vertex_normals
from cadskin.shape.face import Face, Source
from cadskin.shape.fingerprint import FaceFingerprint, FaceMatch, match_faces
from cadskin.shape.ideal import Cone, Cylinder, Freeform, IdealSurface, Plane, Sphere, Torus
from cadskin.shape.nominal import Feature, NominalModel
from cadskin.shape.patches import SmoothPatches, smooth_patches
from cadskin.shape.samples import Samples
from cadskin.shape.selectors import FeatureRef, select, select_one

__all__ = [
    "Cone",
    "Cylinder",
    "DiscreteShape",
    "Face",
    "FaceFingerprint",
    "FaceMatch",
    "Feature",
    "FeatureRef",
    "Freeform",
    "IdealSurface",
    "NominalModel",
    "Plane",
    "Samples",
    "SmoothPatches",
    "Source",
    "Sphere",
    "Torus",
    "match_faces",
    "select",
    "select_one",
    "smooth_patches",
    "triangle_normals",
    "vertex_normals",
]
