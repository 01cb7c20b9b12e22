"""The software engine needs no graphics library; the other one cannot take the process down."""

import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from cadskin.errors import MissingDependencyError
from cadskin.export.content import content_of
from cadskin.view import picture, to_pyvista
from cadskin.view.camera import fit, view_direction
from cadskin.view.pyvista_engine import render_in_child
from cadskin.view.scene import scene_of
from cadskin.view.software import BACKGROUND, render


def test_a_picture_needs_no_graphics_library_and_no_display(tmp_path):
    code = f"""
        import sys
        class Refuse:
            def find_spec(self, name, path=None, target=None):
                if name.split(".")[0] in ("vtk", "vtkmodules", "pyvista", "OpenGL", "PIL", "OCP"):
                    raise ImportError(name)
        sys.meta_path.insert(0, Refuse())
        from cadskin.shape import DiscreteShape
        from cadskin.view import picture
        tet = DiscreteShape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                            [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 1, 2, 3])
        picture({str(tmp_path / "a.png")!r}, tet, size=(200, 150))
    """
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], check=True, timeout=120, env=environment)
    assert (tmp_path / "a.png").read_bytes()[1:4] == b"PNG"


def test_a_crash_of_the_other_engine_is_an_error_and_not_the_end(tmp_path, monkeypatch, array_box):
    pytest.importorskip("pyvista", reason="without it the child is not started")
    crash = tmp_path / "python"
    crash.write_text("#!/bin/sh\necho 'libGL error: no display' >&2\nkill -ABRT $$\n")
    crash.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(crash))
    with pytest.raises(MissingDependencyError, match=r"no display.*libgl1.*engine='software'"):
        picture(tmp_path / "a.png", array_box, engine="pyvista")
    assert not (tmp_path / "a.png").exists()


def test_a_missing_pyvista_is_named_with_its_install_line(tmp_path, monkeypatch, array_box):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r"cadskin\[view\]"):
        picture(tmp_path / "a.png", array_box, engine="pyvista")
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(MissingDependencyError, match=r"cadskin\[view\]"):
        to_pyvista(array_box)


@pytest.mark.needs_rendering
def test_both_engines_draw_the_same_silhouette_and_colours(array_shaft, plain_skin):
    pytest.importorskip("pyvista", reason="the optional engine")
    skin = plain_skin(array_shaft, np.array([0.05, -0.05, -0.03])[array_shaft.feature_ids()])
    scene = scene_of(content_of(skin), low=-0.05, high=0.05)
    camera = fit(view_direction("iso"), scene.points, (20, 40, 260, 280))
    try:
        other = render_in_child(scene, camera, (300, 300), edges=False, lit=False)
    except MissingDependencyError as error:
        pytest.skip(str(error))
    ours = render(scene, camera, (300, 300), edges=False, lit=False)
    masks = [np.abs(p - np.array(BACKGROUND)).max(axis=2) > 0.1 for p in (ours, other)]
    ours_inside, other_inside = (binary_erosion(mask, iterations=2) for mask in masks)
    assert masks[1][ours_inside].all()  # they may differ along the border, by their smoothing
    assert masks[0][other_inside].all()
    both = ours_inside & other_inside
    assert both.sum() > 20_000
    assert np.quantile(np.abs(ours - other)[both], 0.95) < 0.01


def test_to_pyvista_carries_the_fields(array_box, plain_skin):
    pytest.importorskip("pyvista", reason="the conversion's target")
    skin = plain_skin(array_box)
    mesh = to_pyvista(skin)
    assert mesh.is_manifold
    np.testing.assert_array_equal(mesh.points, skin.surface.points)
    np.testing.assert_array_equal(mesh.regular_faces, skin.surface.triangles)
    np.testing.assert_array_equal(mesh.point_data["deviation"], skin.vertex_deviation)
    np.testing.assert_array_equal(mesh.cell_data["face_id"], skin.surface.face_ids)
    np.testing.assert_allclose(mesh.volume, skin.surface.volume, rtol=1e-9)
