"""All parameters of all models: designs, shares, files, and whatever a user may give for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from model_examples import EXAMPLES
from scipy import stats

from cadskin.deviation import (
    BasisForm,
    DeviationModel,
    Modes,
    SizeOffset,
    WhiteNoise,
    from_dict,
    from_text,
    model_names,
    parameter_design,
    with_parameter,
)
from cadskin.deviation._shares import DEFAULT_SHARES
from cadskin.errors import DeviationError
from cadskin.spec import Specification, flatness
from cadskin.spec.toml_read import parse_spec
from cadskin.spec.toml_write import to_toml

# Lengths that are no amplitude of a deviation: shares of a tolerance have no meaning for them.
LENGTHS = {
    "length", "lower", "upper", "centre", "origin", "vector", "translation", "thickness", "wavelength",
    "longest", "shortest", "values", "displacements", "points", "reach",
}  # fmt: skip
EVERY = sorted(EXAMPLES)
WRITABLE = sorted(set(EXAMPLES) - {"function"})
LONG = {"array", "fe", "scan", "towards"}  # the text form leaves out arrays, clouds and surfaces


def numbers_in(place, path=""):
    """Paths of all numbers inside of a model, and their values."""
    if isinstance(place, (bool, str, np.bool_)) or place is None or callable(place):
        return
    if isinstance(place, (int, float, np.number)):
        yield path.removeprefix("."), place
    elif isinstance(place, Mapping):
        for key, value in place.items():
            yield from numbers_in(value, f"{path}.{key}")
    elif isinstance(place, (tuple, np.ndarray)):
        for k, value in enumerate(place):
            yield from numbers_in(value, f"{path}.{k}")
    elif is_dataclass(place):
        for item in fields(place):
            yield from numbers_in(getattr(place, item.name), f"{path}.{item.name}")


def nearby(value):
    """Another value that the parameter can have as well."""
    return value + 1 if isinstance(value, int) else value * 1.03125


def through_a_spec_file(model):
    spec = Specification(flatness(">Z", 0.02, model=model.to_dict()))
    (tolerance,) = tuple(parse_spec(to_toml(spec)))
    return from_dict(tolerance.model)


def test_every_model_has_an_example():
    assert set(EXAMPLES) == set(model_names())
    assert all(model.name == name for name, model in EXAMPLES.items())


@pytest.mark.parametrize("name", WRITABLE)
def test_every_number_has_a_path(name):
    """A number changed by its path is the only one that changes, here and in the file."""
    model = EXAMPLES[name]
    before = dict(numbers_in(model))
    assert before
    for path, value in before.items():
        changed = with_parameter(model, path, nearby(value))
        after = dict(numbers_in(changed))
        if not path.startswith(("target.axis", "axis")):  # unit vectors are made anew
            assert after == pytest.approx({**before, path: nearby(value)}, rel=1e-12), path
        assert through_a_spec_file(changed) == changed
        if name not in LONG:
            assert str(from_text(str(changed))) == str(changed)


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol"])
@pytest.mark.parametrize("name", WRITABLE)
def test_designs_over_all_numbers(name, method):
    model = EXAMPLES[name]
    laws = {
        path: stats.uniform(min(value, nearby(value)), abs(nearby(value) - value))
        for path, value in numbers_in(model)
        if not isinstance(value, int) and value != 0.0
    }
    laws |= {p: stats.randint(v, v + 3) for p, v in numbers_in(model) if isinstance(v, int)}
    design = parameter_design(model, laws, size=4, method=method, rng=1)
    assert design.names == tuple(laws)
    for row, made in zip(design.values, design.models, strict=True):
        found = dict(numbers_in(made))
        assert [found[path] for path in laws] == pytest.approx(list(row), rel=1e-12)
    again = parameter_design(model, laws, size=4, method=method, rng=1)
    assert again.models == design.models


@pytest.mark.parametrize("name", EVERY)
def test_every_length_is_an_amplitude_or_not(name):
    """A new parameter in mm has to be listed: as one that takes shares, or as one that does not."""
    in_mm = {item.name for item in fields(EXAMPLES[name]) if item.metadata.get("unit") == "mm"}
    assert in_mm <= set(DEFAULT_SHARES) | LENGTHS


def shared(value, text):
    if isinstance(value, Mapping):
        return dict.fromkeys(value, text)
    return (text,) * len(value) if isinstance(value, tuple) else text


AMPLITUDES = [(n, f.name) for n in EVERY for f in fields(EXAMPLES[n]) if f.name in DEFAULT_SHARES]


@pytest.mark.parametrize(("name", "key"), AMPLITUDES)
def test_every_amplitude_takes_shares(name, key):
    model = EXAMPLES[name]
    for text, share in (("from tolerance", DEFAULT_SHARES[key]), ("0.25 of tolerance", 0.25)):
        waiting = replace(model, **{key: shared(getattr(model, key), text)})
        with pytest.raises(DeviationError, match=rf"{key} is a share of a tolerance.*resolved\(tolerance"):
            waiting.prepare(None)
        assert through_a_spec_file(waiting) == waiting
        assert str(from_text(str(waiting))) == str(waiting)
        for one, inside in ((waiting, model), (0.5 * waiting + WhiteNoise(1.0), None)):
            resolved = one.resolved(tolerance=0.4)
            if inside is not None:
                expected = shared(getattr(model, key), 0.4 * share)
                assert resolved == replace(model, **{key: expected})
            assert "of tolerance" not in str(resolved)


def test_shares_of_lists_and_tables_stand_beside_numbers():
    assert Modes(["0.5 of tolerance", 0.01]).resolved(tolerance=0.1) == Modes([0.05, 0.01])
    mixed = BasisForm("dct", {"1,0": "from tolerance", "2,0": 0.01})
    assert mixed.resolved(tolerance=0.8) == BasisForm("dct", {"1,0": 0.1, "2,0": 0.01})
    assert SizeOffset("from tolerance").resolved(tolerance=0.2) == SizeOffset(0.05)


HOSTILE = {
    "NaN": np.nan,
    "infinity": np.inf,
    "a word": "abc",
    "a number as text": "0.01",
    "a truth value": True,
    "nothing": None,
    "an empty list": [],
    "an empty table": {},
    "an object": object(),
    "a complex number": 1j,
    "words": np.array(["a", "b"]),
    "a list with NaN": np.array([1.0, np.nan, 1.0]),
    "a ragged list": [[1.0], [1.0, 2.0]],
}
NONE_IS_LEFT_OUT = {"lower", "upper", "count", "thickness", "origin", "direction", "centre"}


def has_a_meaning(key, label):
    """Values of the list that some parameter takes."""
    return (
        (label == "nothing" and key in NONE_IS_LEFT_OUT)
        or (label == "infinity" and key in ("lower", "upper"))
        or (label == "an empty list" and key in ("arguments", "lower", "upper"))
        or (label == "a truth value" and key == "random")
        or (label == "an empty table" and key == "filters")
        or key == "ref"  # whatever selects features, seen when the part is there
    )


@pytest.mark.parametrize("name", EVERY)
def test_whatever_is_given_the_message_names_the_parameter(name):
    model = EXAMPLES[name]
    for item in fields(model):
        for label, value in HOSTILE.items():
            if has_a_meaning(item.name, label):
                continue
            with pytest.raises(DeviationError) as caught:
                replace(model, **{item.name: value})
            assert item.name in str(caught.value), (item.name, label)


POSITIVE = ("sigma", "length", "wavelength", "longest", "shortest", "reach", "sweeps", "anisotropy", "lobes")


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_zero_and_less_is_refused(name, value):
    model = EXAMPLES[name]
    for key in {item.name for item in fields(model)} & set(POSITIVE):
        with pytest.raises(DeviationError, match=rf"{key} must be .*(0|1)"):
            replace(model, **{key: value})


@pytest.mark.parametrize("name", ["sum", "scaled", "on", "randomised"])
def test_models_inside_must_be_models(name):
    key = "terms" if name == "sum" else "model"
    with pytest.raises(DeviationError, match=f"{key} must be"):
        replace(EXAMPLES[name], **{key: "noise"})
    assert isinstance(EXAMPLES[name], DeviationModel)
