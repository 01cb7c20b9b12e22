"""Parts that hypothesis makes up: whatever comes, the mesh is closed, labelled and true."""

import cadquery as cq
import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cadskin.cad.meshing import mesh_shape
from cadskin.cad.meshing.check import face_areas
from cadskin.cad.meshing.exact import face_properties

size = st.floats(5.0, 40.0)


@st.composite
def parts(draw):
    """A block with a hole, rounded or bevelled edges and a boss, in any measure."""
    x, y, z = draw(size), draw(size), draw(size)
    least = min(x, y, z)
    part = cq.Workplane().box(x, y, z)
    if draw(st.booleans()):
        edges = draw(st.sampled_from(["|Z", "|X", ">Z", "<Y"]))
        part = part.edges(edges).fillet(draw(st.floats(0.02, 0.3)) * least)
    if draw(st.booleans()):
        part = part.faces(">Z").workplane(origin=(0, 0, 0)).hole(draw(st.floats(0.05, 0.35)) * least)
    if draw(st.booleans()):
        radius = draw(st.floats(0.05, 0.3)) * least
        boss = cq.Workplane(obj=cq.Solid.makeCone(radius, draw(st.sampled_from([0.0, 0.5])) * radius, z))
        part = part.union(boss.translate((0.2 * x, 0.1 * y, 0)))
    return part.val()


@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(part=parts(), per_diagonal=st.sampled_from([25.0, 100.0]))
def test_every_part_is_meshed_closed_and_true(part, per_diagonal):
    solids = part.Solids()
    if len(solids) != 1 or not part.isValid():
        return
    mesh = mesh_shape(solids[0].wrapped, edge_length=part.BoundingBox().DiagonalLength / per_diagonal)
    other = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
    assert other.is_watertight
    assert other.is_winding_consistent
    assert not mesh.failed_faces
    if per_diagonal == 100.0:
        exact, _ = face_properties([face.wrapped for face in solids[0].Faces()])
        found = face_areas(mesh.points, mesh.triangles, mesh.face_ids, len(exact))
        np.testing.assert_allclose(found, exact, rtol=0.02)
        assert other.volume == pytest.approx(part.Volume(), rel=0.01)
