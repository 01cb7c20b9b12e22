"""As-manufactured parts from CAD: skin model shapes (ISO 17450) inside their tolerances.

>>> import cadquery as cq, cadskin as cs
>>> part = cs.nominal(cq.Workplane().box(60, 40, 8), edge_length=4.0)
>>> skin = cs.simulate(part, cs.GaussianField(sigma=0.01, length=15), rng=7)
>>> skin.closed
True

Names load on first use, so that ``import cadskin`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Public name -> module that owns it.
_HOMES = {
    # geometry in
    "nominal": "cadskin.cad",
    "nominals": "cadskin.cad",
    "read_parts": "cadskin.cad",
    # the nominal model
    "DiscreteShape": "cadskin.shape",
    "Face": "cadskin.shape",
    "Feature": "cadskin.shape",
    "NominalModel": "cadskin.shape",
    # the specification
    "read_pmi": "cadskin.cad",
    "write_step": "cadskin.cad",
    "Datum": "cadskin.spec",
    "DatumSystem": "cadskin.spec",
    "Dimension": "cadskin.spec",
    "Specification": "cadskin.spec",
    "Tolerance": "cadskin.spec",
    "ToleranceZone": "cadskin.spec",
    "angularity": "cadskin.spec",
    "circular_runout": "cadskin.spec",
    "coaxiality": "cadskin.spec",
    "concentricity": "cadskin.spec",
    "cylindricity": "cadskin.spec",
    "distance": "cadskin.spec",
    "flatness": "cadskin.spec",
    "line_profile": "cadskin.spec",
    "parallelism": "cadskin.spec",
    "perpendicularity": "cadskin.spec",
    "position": "cadskin.spec",
    "read_spec": "cadskin.spec",
    "roundness": "cadskin.spec",
    "size": "cadskin.spec",
    "straightness": "cadskin.spec",
    "surface_profile": "cadskin.spec",
    "symmetry": "cadskin.spec",
    "total_runout": "cadskin.spec",
    # deviation models
    "BasisForm": "cadskin.deviation",
    "Bend": "cadskin.deviation",
    "Cone": "cadskin.deviation",
    "Cylinder": "cadskin.deviation",
    "DeviationModel": "cadskin.deviation",
    "Ellipsoid": "cadskin.deviation",
    "Fractal": "cadskin.deviation",
    "FromArray": "cadskin.deviation",
    "FromFE": "cadskin.deviation",
    "FromFunction": "cadskin.deviation",
    "FromScan": "cadskin.deviation",
    "FromSpectrum": "cadskin.deviation",
    "GaussianField": "cadskin.deviation",
    "Gibbs": "cadskin.deviation",
    "KarhunenLoeve": "cadskin.deviation",
    "Lobing": "cadskin.deviation",
    "Modes": "cadskin.deviation",
    "Paraboloid": "cadskin.deviation",
    "Quadric": "cadskin.deviation",
    "Randomised": "cadskin.deviation",
    "Saddle": "cadskin.deviation",
    "Shift": "cadskin.deviation",
    "SizeOffset": "cadskin.deviation",
    "Sphere": "cadskin.deviation",
    "Taper": "cadskin.deviation",
    "Thermal": "cadskin.deviation",
    "Tilt": "cadskin.deviation",
    "Torsor": "cadskin.deviation",
    "Towards": "cadskin.deviation",
    "Twist": "cadskin.deviation",
    "VibrationModes": "cadskin.deviation",
    "Waviness": "cadskin.deviation",
    "WhiteNoise": "cadskin.deviation",
    "morph": "cadskin.deviation",
    # skin model shapes
    "SkinEnsemble": "cadskin.skin",
    "SkinModel": "cadskin.skin",
    "check_skin": "cadskin.skin",
    "simulate": "cadskin.skin",
    "simulate_ensemble": "cadskin.skin",
    "simulate_in_profile_zone": "cadskin.skin",
    "simulate_run": "cadskin.export",
    "open_run": "cadskin.export",
    "weld": "cadskin.skin",
    # verification
    "Association": "cadskin.shape.association",
    "Evaluation": "cadskin.verify",
    "Verification": "cadskin.verify",
    "associate": "cadskin.shape.association",
    "verify": "cadskin.verify",
    # measured parts and statistics of populations
    "read_points": "cadskin.cad.measured",
    "read_qif": "cadskin.cad.measured",
    "MeasuredPart": "cadskin.stats",
    "StatisticalShapeModel": "cadskin.stats",
    "measure": "cadskin.stats",
    "register": "cadskin.stats",
    # out
    "picture": "cadskin.view",
    "sheet": "cadskin.view",
    "to_meshio": "cadskin.export",
    "to_pyvista": "cadskin.view",
    "to_trimesh": "cadskin.export",
    "write": "cadskin.export",
    # errors
    "CadskinError": "cadskin.errors",
    "CadskinWarning": "cadskin.errors",
}

__all__ = ["__version__", *sorted(_HOMES)]

if TYPE_CHECKING:
    from cadskin.cad import nominal as nominal
    from cadskin.cad import nominals as nominals
    from cadskin.cad import read_parts as read_parts
    from cadskin.cad import read_pmi as read_pmi
    from cadskin.cad import write_step as write_step
    from cadskin.cad.measured import read_points as read_points
    from cadskin.cad.measured import read_qif as read_qif
    from cadskin.deviation import BasisForm as BasisForm
    from cadskin.deviation import Bend as Bend
    from cadskin.deviation import Cone as Cone
    from cadskin.deviation import Cylinder as Cylinder
    from cadskin.deviation import DeviationModel as DeviationModel
    from cadskin.deviation import Ellipsoid as Ellipsoid
    from cadskin.deviation import Fractal as Fractal
    from cadskin.deviation import FromArray as FromArray
    from cadskin.deviation import FromFE as FromFE
    from cadskin.deviation import FromFunction as FromFunction
    from cadskin.deviation import FromScan as FromScan
    from cadskin.deviation import FromSpectrum as FromSpectrum
    from cadskin.deviation import GaussianField as GaussianField
    from cadskin.deviation import Gibbs as Gibbs
    from cadskin.deviation import KarhunenLoeve as KarhunenLoeve
    from cadskin.deviation import Lobing as Lobing
    from cadskin.deviation import Modes as Modes
    from cadskin.deviation import Paraboloid as Paraboloid
    from cadskin.deviation import Quadric as Quadric
    from cadskin.deviation import Randomised as Randomised
    from cadskin.deviation import Saddle as Saddle
    from cadskin.deviation import Shift as Shift
    from cadskin.deviation import SizeOffset as SizeOffset
    from cadskin.deviation import Sphere as Sphere
    from cadskin.deviation import Taper as Taper
    from cadskin.deviation import Thermal as Thermal
    from cadskin.deviation import Tilt as Tilt
    from cadskin.deviation import Torsor as Torsor
    from cadskin.deviation import Towards as Towards
    from cadskin.deviation import Twist as Twist
    from cadskin.deviation import VibrationModes as VibrationModes
    from cadskin.deviation import Waviness as Waviness
    from cadskin.deviation import WhiteNoise as WhiteNoise
    from cadskin.deviation import morph as morph
    from cadskin.errors import CadskinError as CadskinError
    from cadskin.errors import CadskinWarning as CadskinWarning
    from cadskin.export import open_run as open_run
    from cadskin.export import simulate_run as simulate_run
    from cadskin.export import to_meshio as to_meshio
    from cadskin.export import to_trimesh as to_trimesh
    from cadskin.export import write as write
    from cadskin.shape import DiscreteShape as DiscreteShape
    from cadskin.shape import Face as Face
    from cadskin.shape import Feature as Feature
    from cadskin.shape import NominalModel as NominalModel
    from cadskin.shape.association import Association as Association
    from cadskin.shape.association import associate as associate
    from cadskin.skin import SkinEnsemble as SkinEnsemble
    from cadskin.skin import SkinModel as SkinModel
    from cadskin.skin import check_skin as check_skin
    from cadskin.skin import simulate_ensemble as simulate_ensemble
    from cadskin.skin import simulate_in_profile_zone as simulate_in_profile_zone
    from cadskin.skin.simulate import simulate as simulate  # the module has the same name: mypy minds
    from cadskin.skin.weld import weld as weld
    from cadskin.spec import Datum as Datum
    from cadskin.spec import DatumSystem as DatumSystem
    from cadskin.spec import Dimension as Dimension
    from cadskin.spec import Specification as Specification
    from cadskin.spec import Tolerance as Tolerance
    from cadskin.spec import ToleranceZone as ToleranceZone
    from cadskin.spec import angularity as angularity
    from cadskin.spec import circular_runout as circular_runout
    from cadskin.spec import coaxiality as coaxiality
    from cadskin.spec import concentricity as concentricity
    from cadskin.spec import cylindricity as cylindricity
    from cadskin.spec import distance as distance
    from cadskin.spec import flatness as flatness
    from cadskin.spec import line_profile as line_profile
    from cadskin.spec import parallelism as parallelism
    from cadskin.spec import perpendicularity as perpendicularity
    from cadskin.spec import position as position
    from cadskin.spec import read_spec as read_spec
    from cadskin.spec import roundness as roundness
    from cadskin.spec import size as size
    from cadskin.spec import straightness as straightness
    from cadskin.spec import surface_profile as surface_profile
    from cadskin.spec import symmetry as symmetry
    from cadskin.spec import total_runout as total_runout
    from cadskin.stats import MeasuredPart as MeasuredPart
    from cadskin.stats import StatisticalShapeModel as StatisticalShapeModel
    from cadskin.stats import measure as measure
    from cadskin.stats import register as register
    from cadskin.verify import Evaluation as Evaluation
    from cadskin.verify import Verification as Verification
    from cadskin.verify import verify as verify
    from cadskin.view import picture as picture
    from cadskin.view import sheet as sheet
    from cadskin.view import to_pyvista as to_pyvista


def __getattr__(name: str) -> Any:
    try:
        home = _HOMES[name]
    except KeyError:
        raise AttributeError(f"module 'cadskin' has no attribute {name!r}") from None
    try:
        room = import_module(home)
        # A room with the name of its verb (verify) can be called itself: the name always means the room.
        value = room if home == f"{__name__}.{name}" else getattr(room, name)
    except ImportError as error:
        raise _explained(error) from error
    globals()[name] = value
    return value


def _explained(error: ImportError) -> ImportError:
    """Return an error that says what to install, where the cause is known (no libGL, the wrong OCP wheel)."""
    from cadskin.doctor import cause_of_import_error
    from cadskin.errors import MissingDependencyError

    cause = cause_of_import_error(error)
    return error if cause is None else MissingDependencyError(cause)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
