"""The part of the galleries 20 to 24: models lie on its freeform face, its plane and its cylinder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import cadskin as cs

PART = Path(__file__).resolve().parent / "parts" / "gallery.step"


def part() -> cs.NominalModel:
    return cs.nominal(PART, edge_length=1.5)


def shown(nominal: cs.NominalModel) -> list[cs.Feature]:
    """Return the freeform face, the mantle of the boss and the plane around it."""
    return [f for f in nominal.features if f.kind != "plane" or 1600 < f.area < 1700]


def by_kind(
    *, plane: cs.DeviationModel, cylinder: cs.DeviationModel, freeform: cs.DeviationModel
) -> cs.DeviationModel:
    return plane.on(kind="plane") + cylinder.on(kind="cylinder") + freeform.on(kind="extrusion")


def skins(nominal: cs.NominalModel, models: Mapping[str, cs.DeviationModel]) -> dict[str, cs.SkinModel]:
    faces = shown(nominal)
    return {
        title: cs.simulate(nominal, model.on(faces), rng=4, check=False) for title, model in models.items()
    }


def covered(made: Mapping[str, cs.SkinModel]) -> int:
    """Count the models that move the freeform face, the plane and the cylinder of a closed skin."""
    return sum(
        skin.closed and all(np.abs(skin.deviation[f.rows]).max() > 1e-3 for f in shown(skin.nominal))
        for skin in made.values()
    )


def draw(path: str, made: Mapping[str, cs.SkinModel], *, columns: int, tile: tuple[int, int]) -> None:
    cs.sheet(
        path,
        list(made.values()),
        list(made),
        columns=columns,
        tile=tile,
        common_bar=True,
        edges=False,
        clim=0.1,
    )
