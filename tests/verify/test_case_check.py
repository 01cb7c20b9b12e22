"""Questions that are not well formed are refused with the entry, what it is, and what it should be."""

from __future__ import annotations

import copy
import json
import random

import numpy as np
import pytest

from cadskin.errors import CadskinError, SpecificationError
from cadskin.verify import evaluate_case, read_case

SQUARE = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.1], [10.0, 10.0, 0.0], [0.0, 10.0, 0.1]]
FLAT = {"csv": "case.csv", "characteristic": "flatness"}


def written(folder, question, features=None):
    rows = [
        f"{label},{x!r},{y!r},{z!r}"
        for label, points in (features or {"S": SQUARE}).items()
        for x, y, z in np.asarray(points, dtype=float).tolist()
    ]
    (folder / "case.csv").write_text("\n".join(["feature,x,y,z", *rows]) + "\n")
    (folder / "case.json").write_text(json.dumps(question))
    return folder / "case.json"


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        ({"datums": "A"}, "datums"),
        ({"datums": [7]}, "datums"),
        ({"datums": [{"label": "A", "axis_hint": [0, 0, 0]}]}, "axis_hint"),
        ({"toleranced": "T"}, "toleranced"),
        ({"tolerance": "0.1"}, "tolerance"),
        ({"TED": "30, 25"}, "TED"),
        ({"TED": [1, 2, 3, 4]}, "TED"),
        ({"TED": [{"xy": [0, 0]}]}, "TED"),
        ({"TED_angle_deg": "30"}, "TED_angle_deg"),
        ({"TED_angle_deg": float("nan")}, "TED_angle_deg"),
        ({"section_plane_normal": [0, 0, 0]}, "section_plane_normal"),
        ({"section_plane_normal": [0, 0]}, "section_plane_normal"),
        ({"outward_normal_hint": [0, 0, "1"]}, "outward_normal_hint"),
        ({"nominal": {"type": "plane"}}, "nominal"),
        ({"start_pose": {"axes": [[1, 0, 0], [0, 1, 0], [0, 0, 2]], "origin": [0, 0, 0]}}, "orthonormal"),
        ({"start_pose": {"origin": [0, 0, 0]}}, "start_pose"),
        ({"free_dof": "tx"}, "free_dof"),
        ({"zone_offset_UZ": None, "filter": "Gauss 50"}, "filter"),
        ({"characteristic": 3}, "characteristic"),
        ({"tolerances": 0.1}, "did you mean 'tolerance'"),
        ({"section_plane_norml": [0, 0, 1]}, "did you mean 'section_plane_normal'"),
    ],
)
def test_entry_of_the_wrong_kind(tmp_path, entry, text):
    with pytest.raises(SpecificationError, match=text):
        read_case(written(tmp_path, {**FLAT, **entry}))


def test_order_of_entries_and_remarks_change_nothing(tmp_path):
    question = {**FLAT, "id": "own", "licence": "none", "notes": "", "generator": "by hand", "reference": {}}
    value = evaluate_case(read_case(written(tmp_path, question))).value
    keys = list(question)
    random.Random(3).shuffle(keys)
    found = evaluate_case(read_case(written(tmp_path, {key: question[key] for key in keys})))
    assert found.value == value
    assert found.notes[-1] == "not read: generator"


@pytest.mark.parametrize("seed", range(60))
def test_damaged_questions_never_end_in_a_traceback(tmp_path, seed):
    """Entries are dropped, replaced or nested at random: a value or a named error, nothing else."""
    rng = random.Random(seed)
    cloud = np.random.default_rng(seed).uniform(-20, 20, (30, 3))
    features = {"A": cloud * [1, 1, 0], "T": cloud * [1, 1, 0.001] + [0, 0, 9], "hole": cloud}
    question = {
        "csv": "case.csv",
        "characteristic": rng.choice(
            ["parallelism", "angularity", "position", "profile of a surface", "coaxiality"]
        ),
        "datums": [{"label": "A", "feature_type": "plane", "outward_normal_hint": [0, 0, -1]}],
        "toleranced": {"feature": "T", "type": "plane"},
        "TED": [9.0],
        "TED_angle_deg": 3.0,
        "nominal": [{"type": "plane", "point": [0, 0, 9], "outward_normal": [0, 0, 1], "feature": "T"}],
        "start_pose": {"axes": np.eye(3).tolist(), "origin": [0, 0, 0]},
        "free_dof": ["tz"],
        "tolerance": {"t": 0.1},
    }
    junk = [None, 0, -1.5, "x", [], {}, [1, 2], [None], {"type": 4}, [{"label": 1}], True, [[1, 2], [3]]]
    for _ in range(rng.randint(1, 3)):
        key = rng.choice(list(question)[1:])
        inner = question[key]
        target = rng.choice([question, inner[0] if isinstance(inner, list) and inner else inner])
        if isinstance(target, dict) and target:
            place = key if target is question else rng.choice(list(target))
            target[place] = copy.deepcopy(rng.choice(junk))
    try:
        found = evaluate_case(read_case(written(tmp_path, question, features)))
    except CadskinError:
        return  # refused by name: fine
    assert np.isfinite(found.value)
