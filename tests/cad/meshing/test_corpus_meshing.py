"""Real files: every valid solid is closed at two edge lengths, its faces have their areas, its wedges fit."""

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from OCP.STEPControl import STEPControl_Reader
from support.wedges import assert_wedges_agree_with_the_mesh

from cadskin.cad._occ import is_valid, solids_of
from cadskin.cad.meshing import mesh_shape
from cadskin.cad.meshing.build import read_part
from cadskin.cad.meshing.check import face_areas
from cadskin.cad.meshing.exact import box_diagonal
from cadskin.shape.check import triangle_quality

CORPUS = Path(os.environ.get("CADSKIN_CORPUS", Path(__file__).parents[4] / "shared" / "corpus"))
FILES = sorted((CORPUS / "step").glob("*.st*p")) if CORPUS.is_dir() else []

pytestmark = [
    pytest.mark.corpus,
    pytest.mark.slow,
    pytest.mark.skipif(not FILES, reason="no STEP corpus; set CADSKIN_CORPUS"),
]


@pytest.fixture(scope="module", params=FILES, ids=lambda path: path.stem)
def solids(request):
    reader = STEPControl_Reader()
    reader.ReadFile(str(request.param))
    reader.TransferRoots()
    found = [solid for solid in solids_of(reader.OneShape()) if is_valid(solid)]
    assert found
    different = {}
    for solid in found:
        different.setdefault(round(box_diagonal(solid), 6), solid)
    return list(different.values())


@pytest.mark.parametrize("per_diagonal", [100, 25])
def test_every_valid_solid_is_closed(solids, per_diagonal):
    for solid in solids:
        mesh = mesh_shape(solid, edge_length=box_diagonal(solid) / per_diagonal)
        other = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
        assert other.is_watertight
        assert other.is_winding_consistent
        assert not mesh.failed_faces
        assert_wedges_agree_with_the_mesh(mesh)


def test_areas_and_volumes_are_those_of_the_file(solids):
    for solid in solids:
        part = read_part(solid)
        mesh = mesh_shape(solid, edge_length=part.diagonal / 100)
        found = face_areas(mesh.points, mesh.triangles, mesh.face_ids, len(part.areas))
        open_area = part.blur  # what the file's own edge tolerances leave open
        assert (np.abs(found - part.areas) <= 0.02 * part.areas + open_area).all()
        volume = trimesh.Trimesh(mesh.points, mesh.triangles, process=False).volume
        assert volume == pytest.approx(part.volume, rel=0.01)
        quality = triangle_quality(mesh.points, mesh.triangles)
        assert np.median(quality) >= 0.98
