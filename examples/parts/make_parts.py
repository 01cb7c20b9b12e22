"""Write the example parts beside this file, with cadquery: the same text at every run (no date in it)."""

from __future__ import annotations

import re
from pathlib import Path

import cadquery as cq

FOLDER = Path(__file__).resolve().parent


def bracket() -> cq.Workplane:
    """Return an angle bracket 60 x 40 x 30 mm, 6 mm thick: four holes, a fillet, rounded corners."""
    profile = cq.Workplane("XZ").polyline([(0, 0), (60, 0), (60, 6), (6, 6), (6, 30), (0, 30)]).close()
    angle = profile.extrude(40).translate((0, 40, 0))
    angle = angle.edges(cq.NearestToPointSelector((6, 20, 6))).fillet(4)
    angle = angle.edges("|Z and >X").fillet(8)
    angle = angle.faces(">Z[-2]").workplane(origin=(36, 20, 6)).rarray(24, 20, 2, 2).hole(5.5)
    return angle.faces("<X").workplane(origin=(0, 20, 20)).hole(9)


def plate() -> cq.Workplane:
    """Return a plate 60 x 40 x 8 mm with one bore of 12 mm."""
    return cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12)


def flange() -> cq.Workplane:
    """Return a turned flange of 80 mm with a cone, a fillet and six holes on a circle."""
    outline = [(12, 0), (40, 0), (40, 8), (22, 8), (18, 30), (12, 30)]
    body = cq.Workplane("XZ").polyline(outline).close().revolve(360, (0, 0, 0), (0, 1, 0))
    body = body.edges(cq.selectors.RadiusNthSelector(2)).edges("<Z").fillet(1)
    return body.faces("<Z").workplane(origin=(0, 0, 0)).polarArray(31, 0, 360, 6).hole(6)


def hinge() -> cq.Assembly:
    """Return two solids in one file: a block with a bore, and the pin in it."""
    block = cq.Workplane().box(40, 30, 20).faces(">X").workplane().hole(10)
    pin = cq.Workplane("YZ").circle(4.95).extrude(50).translate((-25, 0, 0))
    both = cq.Assembly(name="hinge")
    both.add(block, name="block", color=cq.Color(0.6, 0.65, 0.7))
    both.add(pin, name="pin", color=cq.Color(0.8, 0.6, 0.2))
    return both


def gallery() -> cq.Workplane:
    """Return a block with a freeform top on the left, a plane on the right and a boss on it."""
    outline = cq.Workplane("XZ", origin=(0, 25, 0)).moveTo(-40, 0).lineTo(40, 0).lineTo(40, 10).lineTo(0, 10)
    waves = [(-12, 15), (-26, 9), (-40, 13)]
    body = outline.spline(waves, includeCurrent=True).close().extrude(50)
    return body.union(cq.Workplane(origin=(20, 0, 10)).circle(10).extrude(15))


def main() -> int:
    """Write all parts; return the number of their faces."""
    faces = 0
    for make in (bracket, plate, flange, hinge, gallery):
        made = make()
        named = made if isinstance(made, cq.Assembly) else cq.Assembly(made, name=make.__name__)
        path = FOLDER / f"{make.__name__}.step"
        named.export(str(path))
        path.write_text(re.sub(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", "2026-01-01T00:00:00", path.read_text()))
        faces += len(named.toCompound().Faces())
    return faces


if __name__ == "__main__":
    print(f"{main()} faces written to {FOLDER}")
