"""Association (ISO 17450-1): fit ideal features to points, with certificates; numpy, scipy and numba only."""

from __future__ import annotations

from cadskin.shape.association.associate import CRITERIA, associate
from cadskin.shape.association.minimax import Minimax, minimax
from cadskin.shape.association.models import (
    CompositeModel,
    DistanceModel,
    Patch,
    SurfaceModel,
    concatenate,
)
from cadskin.shape.association.pose import Pose, frame_about, rotation
from cadskin.shape.association.result import Association, Certificate, Circle, Criterion, Kind, Line

__all__ = [
    "CRITERIA",
    "Association",
    "Certificate",
    "Circle",
    "CompositeModel",
    "Criterion",
    "DistanceModel",
    "Kind",
    "Line",
    "Minimax",
    "Patch",
    "Pose",
    "SurfaceModel",
    "associate",
    "concatenate",
    "frame_about",
    "minimax",
    "rotation",
]
