"""Displacements from CalculiX result files: what the text layout holds, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.cad.measured import read_frd
from cadskin.errors import ReadError

NODES = {7: (0.0, 0.0, 0.0), 2: (10.0, -2.5, 0.125), 12345: (-100.25, 3.0, 1e-5)}
FIELDS = {0.5: (0.1, 0.2, 0.3), 4.0: (-18.5, 1e-4, -0.25)}


def row(number, values):
    return f" -1{number:10d}" + "".join(f"{v:12.5E}" for v in values)


def frd(nodes=NODES, fields=FIELDS):
    """Return a file as ccx 2.20 writes it: negative numbers touch their left neighbour."""
    lines = ["    1C", f"    2C{len(nodes):30d}{'':37s}1"]
    lines += [row(number, place) for number, place in nodes.items()] + [" -3"]
    for step, (time, moved) in enumerate(fields.items(), 1):
        lines += ["    1PSTEP" + f"{step:26d}"]
        lines += [f"  100CL{100 + step:5d}{time:12.9f}{len(nodes):12d}{'':20s}0{step:5d}{'':11s}1"]
        lines += [" -4  DISP        4    1", " -5  D1          1    2    1    0"]
        lines += [row(number, np.array(moved) * (k + 1)) for k, number in enumerate(nodes)] + [" -3"]
    return "\n".join([*lines, " 9999"]) + "\n"


def test_nodes_and_the_last_field_come_back_by_number(tmp_path):
    path = tmp_path / "run.frd"
    path.write_text(frd())
    found = read_frd(path)
    assert found.node_ids.tolist() == [2, 7, 12345]
    np.testing.assert_allclose(found.points, [NODES[i] for i in (2, 7, 12345)], rtol=1e-5)
    factor = {number: k + 1 for k, number in enumerate(NODES)}
    expected = np.array([np.array(FIELDS[4.0]) * factor[i] for i in (2, 7, 12345)])
    np.testing.assert_allclose(found.displacements, expected, rtol=1e-5)
    np.testing.assert_allclose(found.times, [0.5, 4.0])
    np.testing.assert_allclose(found.moved, found.points + found.displacements)
    assert found.source == "run.frd"
    assert len(found) == 3


def cut(text):
    return text[: text.rindex(" -1")]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("solid cube\nendsolid\n", "holds no nodes"),
        (frd(fields={}), "holds no displacements"),
        (cut(frd()), "cut off"),
        (frd().replace(f"{-100.25:12.5E}", "      oh dear"[:12]), "not a number"),
    ],
)
def test_other_files_are_refused_by_name(tmp_path, text, words):
    path = tmp_path / "run.frd"
    path.write_text(text)
    with pytest.raises(ReadError, match=words) as caught:
        read_frd(path)
    assert "run.frd" in str(caught.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ReadError, match="cannot be read"):
        read_frd(tmp_path / "none.frd")
