"""Every model of the registry goes through a spec file and comes back the same, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cadskin.deviation import (
    FromFunction,
    GaussianField,
    SumModel,
    WhiteNoise,
    from_dict,
    from_text,
    model_class,
    model_names,
)
from cadskin.deviation.bases import BASES
from cadskin.deviation.kernels import KERNELS
from cadskin.errors import DeviationError
from cadskin.spec import Specification, flatness
from cadskin.spec.toml_read import parse_spec
from cadskin.spec.toml_write import to_toml

sizes = st.floats(1e-6, 1e3)
reals = st.floats(-1e3, 1e3)
pairs, triples = st.tuples(reals, reals), st.tuples(reals, reals, reals)
directions = st.tuples(st.floats(0.1, 1.0), reals, reals)
kernels = st.sampled_from(sorted(KERNELS))
sigmas = sizes | st.sampled_from(["from tolerance", "0.2 of tolerance"])
amplitudes = reals | st.just("from tolerance")
centres = st.none() | triples
form = {"amplitude": amplitudes, "centre": pairs, "rotation": reals}
rows = st.lists(sizes, min_size=1, max_size=5)
simple = st.builds(WhiteNoise, sizes)

# Parameters of each model, without the composed ones.
PARAMETERS = {
    "noise": {"sigma": sigmas},
    "field": {
        "sigma": sigmas | rows,
        "length": sizes | rows,
        "kernel": kernels,
    },
    "gibbs": {
        "sigma": sigmas,
        "length": sizes,
        "sweeps": st.integers(1, 10**6),
        "lower": st.none() | reals | rows | st.just(-np.inf),
        "order": st.sampled_from(["sequential", "chromatic"]),
    },
    "karhunen_loeve": {"sigma": sigmas, "length": sizes, "kernel": kernels, "count": st.integers(1, 99)},
    "modes": {"amplitudes": st.lists(reals, min_size=1, max_size=4), "first": st.integers(0, 9)},
    "basis": {
        "basis": st.sampled_from(BASES),
        "coefficients": st.dictionaries(
            st.builds("{},{}".format, st.integers(-9, 9), st.integers(-9, 9)), reals, min_size=1, max_size=3
        ),
    },
    "paraboloid": form | {"ratio": reals},
    "saddle": form,
    "cone": form,
    "sphere": form,
    "cylinder": form,
    "ellipsoid": form,
    "quadric": {"k1": reals, "k2": reals, "angle": reals, "centre": pairs, "conic": reals},
    "clamped_bow": form,
    "layers": {"thickness": sizes, "direction": directions},
    "vibration": {
        "amplitudes": st.lists(reals, min_size=1, max_size=4),
        "random": st.booleans(),
        "edges": st.sampled_from(["free", "supported", "fixed"]),
        "thickness": st.none() | sizes,
    },
    "scan": {
        "points": st.lists(triples, min_size=12, max_size=12),
        "reach": sizes,
        "neighbours": st.integers(8, 12),
    },
    "shift": {"vector": triples},
    "tilt": {"angle": reals, "axis": directions, "centre": centres},
    "torsor": {"translation": triples, "rotation": triples, "centre": centres},
    "size": {"offset": reals},
    "taper": {"amplitude": amplitudes},
    "bend": {"amplitude": amplitudes, "axis": directions, "direction": directions},
    "twist": {"angle": reals, "axis": directions, "centre": centres},
    "thermal": {"delta_T": reals, "alpha": sizes, "gradient": triples, "centre": centres},
    "waviness": {"amplitude": amplitudes, "wavelength": sizes, "angle": reals, "phase": reals},
    "lobing": {"amplitude": amplitudes, "lobes": st.integers(1, 40)},
    "spectrum": {
        "frequencies": st.lists(sizes, min_size=3, max_size=3, unique=True).map(sorted),
        "psd": st.lists(sizes, min_size=3, max_size=3),
        "angle": reals,
    },
    "fractal": {
        "sigma": sigmas,
        "hurst": st.floats(0.01, 0.99),
        "longest": st.floats(2, 9),
        "shortest": st.floats(0.1, 1),
    },
    "array": {"values": rows | st.lists(st.lists(reals, min_size=2, max_size=2), min_size=1, max_size=3)},
    "fe": {"displacements": st.lists(triples, min_size=1, max_size=3)},
    "towards": {
        "target": st.fixed_dictionaries(
            {"kind": st.just("sphere"), "centre": triples.map(list), "radius": sizes}
        ),
        "share": reals,
    },
    "randomised": {
        "model": simple,
        "distribution": st.just("norm"),
        "arguments": st.tuples(reals, sizes),
    },
    "sum": {"terms": st.lists(simple, min_size=1, max_size=3)},
    "scaled": {"factor": reals, "model": simple},
    "on": {
        "model": simple,
        "ref": st.none() | st.just(">Z") | st.integers(0, 9) | st.lists(st.integers(0, 9), min_size=1),
        "filters": st.sampled_from([{}, {"kind": "plane"}, {"area": (1.0, 2.5)}]),
    },
}
UNWRITABLE = {"function"}


def through_a_spec_file(model):
    spec = Specification(flatness(">Z", 0.02, model=model.to_dict()))
    (tolerance,) = tuple(parse_spec(to_toml(spec)))
    return from_dict(tolerance.model)


def test_every_model_is_tried():
    assert set(model_names()) == set(PARAMETERS) | UNWRITABLE


@pytest.mark.parametrize("name", sorted(PARAMETERS))
@settings(max_examples=25, deadline=None, database=None)
@given(data=st.data())
def test_round_trip_through_a_spec_file(name, data):
    model = model_class(name)(**data.draw(st.fixed_dictionaries(PARAMETERS[name])))
    assert through_a_spec_file(model) == model
    composed = (model + 0.3 * WhiteNoise(0.01)).on(">Z", kind="plane")
    again = through_a_spec_file(composed)
    assert again == composed
    assert str(again) == str(composed)


@pytest.mark.parametrize("name", sorted(set(PARAMETERS) - {"array", "fe", "scan", "towards"}))
@settings(max_examples=15, deadline=None, database=None)
@given(data=st.data())
def test_the_text_form_is_read_again(name, data):
    """Twelve digits: the text of what was read is the same text."""
    model = model_class(name)(**data.draw(st.fixed_dictionaries(PARAMETERS[name])))
    assume(len(getattr(model, "terms", "two")) > 1)  # a sum of one is printed as that one
    for one in (model, (0.5 * model + WhiteNoise(0.01)).on(">Z", kind="plane")):
        assert str(from_text(str(one))) == str(one)


def test_long_rows_are_told_by_their_range_and_mean_and_not_read_again():
    told = str(GaussianField(np.linspace(0.002, 0.012, 500), 3.0))
    assert told == "GaussianField(sigma=<500 values, 0.002..0.012, mean 0.007> mm, length=3 mm)"
    with pytest.raises(DeviationError, match="leaves out long arrays"):
        from_text(told)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("FromArray(<20 values> mm)", "leaves out long arrays"),
        ("Nonsense(1)", "no deviation model is called Nonsense"),
        ("GaussianField(", "not the text form"),
        ("3.0", "not the text form of a deviation model but 3.0"),
        ("__import__('os').system('ls')", "is not a deviation model"),
        ("WhiteNoise(0.1) / WhiteNoise(0.1)", "joined by"),
        ("WhiteNoise(sigma=undefined)", "has no place"),
    ],
)
def test_other_texts_are_refused(text, message):
    with pytest.raises(DeviationError, match=message):
        from_text(text)


def test_python_functions_are_refused_with_the_way_out():
    for model in (FromFunction(lambda p, n: 0 * p[:, 0]), GaussianField(0.1, lambda p: 3 + p[:, 0])):
        with pytest.raises(DeviationError, match=r"FromArray|give an array"):
            SumModel((WhiteNoise(1.0), model)).to_dict()
