"""When a specification stands on faces already, and when it is bound."""

from __future__ import annotations

import pytest

from cadskin.errors import SpecificationError
from cadskin.spec import Datum, DatumTarget, FeatureSelection, Specification, flatness, size, surface_profile
from cadskin.spec.binding import bound_to
from cadskin.spec.reattach import fingerprinted


def test_selectors_wait_for_faces(array_box):
    spec = Specification(flatness(">Z", 0.1), datums={"A": "<Z"})
    bound = bound_to(spec, array_box)
    assert bound["flatness-1"].feature.faces == (5,)
    assert bound.datum("A").feature.faces == (4,)
    assert bound_to(bound, array_box) is bound


def test_a_dimension_or_target_that_waits_is_bound_too(array_box):
    on_faces = flatness(FeatureSelection(faces=(5,)), 0.1)
    with_size = Specification(on_faces, dimensions=[size(">X", 10.0, (-0.1, 0.1))])
    assert bound_to(with_size, array_box).dimensions[0].feature.faces == (1,)
    target = DatumTarget("A1", origin=(0.0, 0, 0), feature=FeatureSelection(selectors=("<Z",)))
    with_target = Specification(on_faces, datums=[Datum("A", targets=(target,))], checked=False)
    assert bound_to(with_target, array_box).datums[0].targets[0].feature.faces == (4,)


def test_curves_of_a_file_are_no_faces_to_wait_for(array_box):
    on_faces = flatness(FeatureSelection(faces=(5,)), 0.1)
    target = DatumTarget("A1", origin=(0.0, 0, 0), feature=FeatureSelection(step_faces=(77,)))
    spec = Specification(on_faces, datums=[Datum("A", targets=(target,))], checked=False)
    assert bound_to(spec, array_box) is spec


def test_a_general_tolerance_alone_is_bound_so_that_another_part_is_refused(array_box, array_shaft):
    general = Specification(default=surface_profile(None, 0.5, scope="general"))
    assert bound_to(general, array_box).default == general.default
    known = Specification(flatness(5, 0.1), default=general.default).bind(array_box)
    stale = Specification(
        default=general.default, fingerprints=fingerprinted(known, array_box.faces).fingerprints
    )
    assert stale.fingerprints
    with pytest.raises(SpecificationError, match="another export"):
        bound_to(stale, array_shaft)
