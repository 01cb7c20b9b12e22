"""The certificate of a part: what a stranger needs to evaluate it again, from its mesh and the spec."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

import cadskin
from cadskin.errors import ReadError
from cadskin.skin.provenance import nominal_sha256
from cadskin.spec.binding import bound_to
from cadskin.verify import verify

if TYPE_CHECKING:
    from cadskin.shape import DiscreteShape, NominalModel
    from cadskin.skin import SkinModel
    from cadskin.spec import Specification
    from cadskin.verify import Standard, Verification

__all__ = ["Recheck", "certificate_of", "mesh_sha256", "read_certificate", "recheck", "spec_sha256"]

_FORMAT = "cadskin certificate 1"
_RELATIVE = 1e-6  # values of another machine


def certificate_of(
    skin: SkinModel, spec: Specification, *, standard: Standard = "ISO 5459:2011"
) -> dict[str, Any]:
    """Evaluate a part and return its certificate, plain data for JSON.

    Parameters
    ----------
    skin : SkinModel
    spec : Specification
    standard : str
        Of the datum associations.

    Returns
    -------
    dict
        Hashes of nominal model, mesh and specification; version, model, seed and number of the part; value,
        limit, verdict and active points of every tolerance; what could not be evaluated, and why.
    """
    bound = bound_to(spec, skin.nominal)
    found = cast("Verification", verify(skin, bound, standard=standard, sizes=True))
    provenance = skin.provenance.to_dict()
    return {
        "format": _FORMAT,
        "version": cadskin.__version__,
        "units": "mm",
        "standard": standard,
        "part": provenance["source"],
        "nominal_sha256": nominal_sha256(skin.nominal),
        "mesh_sha256": mesh_sha256(skin.surface),
        "spec_sha256": spec_sha256(bound),
        "model": provenance["model"],
        "seed": provenance["seed"],
        "spawn_key": provenance["spawn_key"],
        "index": provenance["index"],
        "conforming": found.conforming,
        "tolerances": [
            {
                "tolerance": name,
                "characteristic": item.characteristic,
                "value": item.value,
                "limit": item.limit,
                "ok": item.ok,
                "certified": item.certified,
                "active": list(item.active),
            }
            for name, item in found.evaluations
        ],
        "unresolved": [{"tolerance": name, "reason": reason} for name, reason in found.unresolved],
    }


def mesh_sha256(surface: DiscreteShape) -> str:
    """Return a hash of the vertices (float64), triangles and face labels of a mesh."""
    digest = hashlib.sha256()
    for array in (surface.points, surface.triangles, surface.face_ids):
        digest.update(repr((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def spec_sha256(spec: Specification) -> str:
    """Return a hash of the text of a specification."""
    return hashlib.sha256(spec.to_toml().encode()).hexdigest()


def read_certificate(path: str | Path) -> dict[str, Any]:
    """Read a certificate.

    Raises
    ------
    ReadError
        Not such a file.
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ReadError(f"{path} cannot be read as a certificate: {error}") from error
    if not isinstance(data, dict) or data.get("format") != _FORMAT:
        raise ReadError(f"{path} is no certificate of this version ({_FORMAT!r})")
    return data


@dataclass(frozen=True)
class Recheck:
    """The outcome of a recheck.

    Parameters
    ----------
    differences : tuple of str
        What is not as the certificate says; empty where all is.
    """

    differences: tuple[str, ...]

    @property
    def confirmed(self) -> bool:
        """Whether everything is as the certificate says."""
        return not self.differences


def recheck(
    certificate: dict[str, Any], surface: DiscreteShape, spec: Specification, nominal: NominalModel
) -> Recheck:
    """Evaluate a mesh again and compare it with its certificate.

    Parameters
    ----------
    certificate : dict
        From `certificate_of` or `read_certificate`.
    surface : DiscreteShape
        The mesh of the part, with face labels.
    spec : Specification
    nominal : NominalModel
        Names the features of the faces.
    """
    bound = bound_to(spec, nominal)
    notes = []
    for what, found in (
        ("nominal_sha256", nominal_sha256(nominal)),
        ("mesh_sha256", mesh_sha256(surface)),
        ("spec_sha256", spec_sha256(bound)),
    ):
        if certificate[what] != found:
            notes.append(f"{what} is {found[:12]}..., the certificate says {certificate[what][:12]}...")
    again = cast(
        "Verification", verify(surface, bound, nominal=nominal, standard=certificate["standard"], sizes=True)
    )
    values = dict(again.evaluations)
    stated = {item["tolerance"]: item for item in certificate["tolerances"]}
    for name in sorted(values.keys() ^ stated.keys()):
        notes.append(f"{name} is {'not in the certificate' if name in values else 'not evaluated'}")
    for name in sorted(values.keys() & stated.keys()):
        value, before = values[name].value, stated[name]
        if (
            abs(value - before["value"]) > _RELATIVE * max(abs(value), 1e-6)
            or values[name].ok != before["ok"]
        ):
            notes.append(f"{name} is {value:.9g} mm, the certificate says {before['value']:.9g} mm")
    if again.conforming != certificate["conforming"]:
        notes.append(f"conforming is {again.conforming}, the certificate says {certificate['conforming']}")
    return Recheck(tuple(notes))
