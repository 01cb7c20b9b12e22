"""The noise: published known-answer vectors, distribution, independence of the order of work."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from cadskin.deviation._philox import philox4x32, standard_normals

# Random123, file kat_vectors, lines "philox4x32 10": counter, key, expected.
KNOWN = [
    ([0] * 4, [0] * 2, [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
    ([0xFFFFFFFF] * 4, [0xFFFFFFFF] * 2, [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]),
    (
        [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
        [0xA4093822, 0x299F31D0],
        [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
    ),
]


@pytest.mark.parametrize(("counter", "key", "expected"), KNOWN)
def test_philox_gives_the_published_words(counter, key, expected):
    words = philox4x32(np.array(counter, np.uint32), np.array(key, np.uint32))
    assert words.tolist() == expected


def test_normals_use_the_checked_generator():
    """The first numbers from Box-Muller in double precision on the words of `philox4x32`."""
    seed = np.random.SeedSequence(11)
    state = seed.generate_state(4, np.uint32)
    row = standard_normals([seed], 1024)[0].astype(float)
    for i in (0, 1, 17, 255):
        w = philox4x32(np.array([i, 0, state[2], state[3]], np.uint32), state[:2]).astype(np.float64)
        for pair in range(2):
            radius = np.sqrt(-2 * np.log((w[2 * pair] + 1) / 2**32))
            found = row[512 * pair + i], row[512 * pair + 256 + i]
            assert np.hypot(*found) == pytest.approx(radius, rel=2e-6)


def test_normals_are_normal():
    """Error level 1e-4 for each of the tests together (fixed seed: no chance of a flaky run)."""
    x = standard_normals([np.random.SeedSequence(3)], 1 << 20)[0].astype(float)
    n = len(x)
    assert abs(x.mean()) < 4 / np.sqrt(n)
    assert abs(x.var() - 1) < 4 * np.sqrt(2 / n)
    assert abs((x**4).mean() - 3) < 4 * np.sqrt(96 / n)
    assert stats.kstest(x[:200_000], "norm").pvalue > 1e-4
    blocks = x[: n // 1024 * 1024].reshape(-1, 4, 256)
    for a, b in ((0, 1), (0, 2), (1, 3)):
        assert abs(np.corrcoef(blocks[:, a].ravel(), blocks[:, b].ravel())[0, 1]) < 4 / np.sqrt(n / 4)
        assert abs(np.corrcoef(blocks[:, a].ravel() ** 2, blocks[:, b].ravel() ** 2)[0, 1]) < 4 / np.sqrt(
            n / 4
        )


def test_tail_counts():
    x = standard_normals([np.random.SeedSequence(k) for k in range(4)], 1 << 20).ravel()
    for limit in (2.0, 3.0, 4.0):
        expected = 2 * stats.norm.sf(limit) * x.size
        assert abs((np.abs(x) > limit).sum() - expected) < 4 * np.sqrt(expected)


def test_a_row_depends_on_its_seed_only():
    seeds = [np.random.SeedSequence(1, spawn_key=(k,)) for k in range(5)]
    together = standard_normals(seeds, 3000)
    alone = standard_normals(seeds[3:4], 3000)
    longer = standard_normals(seeds[3:4], 9000)
    assert np.array_equal(together[3], alone[0])
    assert np.array_equal(longer[0, :3000], alone[0])
    assert abs(np.corrcoef(together)[np.triu_indices(5, 1)]).max() < 4 / np.sqrt(3000)
