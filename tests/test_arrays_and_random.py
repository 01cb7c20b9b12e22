"""Frozen arrays, random streams, progress: the foundation."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin._arrays import frozen
from cadskin._progress import report
from cadskin._random import child, seed_sequence
from cadskin.errors import CadskinError, Cancelled, GeometryError


def test_frozen_copies_what_someone_else_could_write() -> None:
    mine = np.zeros((2, 3))
    kept = frozen(mine)
    mine[0, 0] = 1.0
    assert kept[0, 0] == 0.0
    assert frozen(kept) is kept


def test_frozen_refuses_wrong_shapes() -> None:
    with pytest.raises(GeometryError, match=r"normal has shape \(2,\), expected \(3\)"):
        frozen([0, 1], shape=(3,), name="normal")


@pytest.mark.parametrize("index", [0, 1, 17])
def test_child_equals_spawn(index: int) -> None:
    seed = np.random.SeedSequence(2026)
    spawned = np.random.default_rng(np.random.SeedSequence(2026).spawn(18)[index])
    assert child(seed, index).random() == spawned.random()


def test_a_generator_gives_a_new_seed_each_time_and_the_same_one_again() -> None:
    first, second = np.random.default_rng(1), np.random.default_rng(1)
    assert seed_sequence(first).entropy == seed_sequence(second).entropy
    assert seed_sequence(first).entropy != seed_sequence(np.random.default_rng(1)).entropy


def test_progress_can_stop_the_work() -> None:
    seen = []
    report(lambda done, total: seen.append((done, total)), 1, 3)
    assert seen == [(1, 3)]
    with pytest.raises(Cancelled, match="after 2 of 3"):
        report(lambda done, total: False, 2, 3)


def test_every_error_is_a_cadskin_error_with_an_exit_code() -> None:
    import cadskin.errors as errors

    kinds = [getattr(errors, name) for name in errors.__all__ if name != "CadskinWarning"]
    assert all(issubclass(kind, CadskinError) for kind in kinds)
    assert {kind.exit_code for kind in kinds} == {2, 3, 130}
