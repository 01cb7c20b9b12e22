"""Hypothesis strategies over the whole data model of a specification."""

import math
from dataclasses import replace

from hypothesis import strategies as st

from cadskin.cad.pmi.derived import inferred_derived
from cadskin.shape.fingerprint import FaceFingerprint
from cadskin.spec import (
    CHARACTERISTICS,
    AreaUnit,
    Datum,
    DatumModifier,
    DatumReference,
    DatumSystem,
    DatumTarget,
    Dimension,
    FaceRecord,
    FeatureSelection,
    Indicator,
    Specification,
    Tolerance,
    ToleranceZone,
    Unresolved,
    fit_deviations,
)
from cadskin.spec.dimension import clean_sum
from cadskin.spec.indicators import INDICATOR_KINDS
from cadskin.spec.modifiers import DATUM_MODIFIERS, TOLERANCE_MODIFIERS

LETTERS = "ABCDEF"
lengths = st.floats(1e-6, 1e4)
signed = st.floats(-1e4, 1e4)
maybe_length = st.none() | lengths
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
_ZONE_WORDS = {"COMMON_ZONE", "SEPARATE_ZONE", "MAXIMUM_MATERIAL_REQUIREMENT", "LEAST_MATERIAL_REQUIREMENT"}
_FORMS = {
    "width": ["between two equidistant surfaces", "non uniform"],
    "diameter": ["within a cylinder", "within a circle"],
    "spherical_diameter": ["within a sphere"],
}


@st.composite
def zones(draw):
    shape = draw(st.sampled_from(["width", "width", "diameter", "spherical_diameter"]))
    per = draw(st.sampled_from(["none", "none", "length", "area"]))
    projected = draw(maybe_length)
    area = st.builds(
        AreaUnit,
        st.sampled_from(["square", "rectangular", "circular", "cylindrical", "spherical"]),
        lengths,
        maybe_length,
    )
    return ToleranceZone(
        shape=shape,
        form=draw(st.none() | st.sampled_from(_FORMS[shape])),
        projected=projected,
        projected_offset=draw(maybe_length) if projected is not None else None,
        outside=draw(st.none() | signed),
        maximum=draw(maybe_length),
        per_length=draw(lengths) if per == "length" else None,
        per_area=draw(area) if per == "area" else None,
        combined=draw(st.none() | st.booleans()),
        angle=draw(st.none() | st.floats(0, math.pi)),
    )


@st.composite
def datum_references(draw):
    letters = tuple(draw(st.lists(st.sampled_from(LETTERS), min_size=1, max_size=3, unique=True)))
    with_value = st.builds(
        DatumModifier,
        st.sampled_from(["PROJECTED", "DISTANCE", "SPHERICAL", "CIRCULAR_OR_CYLINDRICAL"]),
        lengths,
    )
    plain = st.builds(DatumModifier, st.sampled_from(sorted(DATUM_MODIFIERS)))
    modifiers = st.lists(plain | with_value, max_size=2).map(tuple)
    elements = tuple(draw(modifiers) for _ in letters) if draw(st.booleans()) else ()
    return DatumReference(letters, draw(modifiers), elements)


datum_systems = st.lists(datum_references(), max_size=3).map(tuple).map(DatumSystem)


@st.composite
def face_selections(draw, kinds, *, grouped=True):
    """Faces of a part whose faces have these kinds, as members of a pattern or as one feature."""
    indices = range(len(kinds))
    faces = tuple(sorted(draw(st.lists(st.sampled_from(indices), min_size=1, max_size=5, unique=True))))
    groups = ()
    if grouped and len(faces) > 1 and draw(st.booleans()):
        cut = draw(st.integers(1, len(faces) - 1))
        groups = (faces[:cut], faces[cut:])
    own = tuple(dict.fromkeys(kinds[face] for face in faces))
    return FeatureSelection(faces=faces, groups=groups, kinds=own)


@st.composite
def plane_indicators(draw):
    """An affected plane with a unit normal that reads back: what AP242 holds of indicators."""
    if not draw(st.booleans()):
        return ()
    direction = draw(st.sampled_from([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.6, 0.8)]))
    kind = draw(st.sampled_from(["intersection_plane", "orientation_plane"]))
    return (Indicator(kind, direction=direction),)


@st.composite
def indicators(draw):
    """Any indicators, one of a kind."""
    found = []
    for kind in draw(st.lists(st.sampled_from(sorted(INDICATOR_KINDS)), max_size=2, unique=True)):
        relation = draw(st.sampled_from(["parallel", "perpendicular", "inclined"]))
        if draw(st.booleans()):
            relation = {"intersection_plane": "symmetrical", "direction_feature": "run_out"}.get(
                kind, relation
            )
        angle = draw(st.floats(0, math.pi)) if relation == "inclined" else None
        if draw(st.booleans()):
            found.append(Indicator(kind, relation, draw(datum_systems.filter(bool)), angle))
        else:
            found.append(Indicator(kind, relation, angle=angle, direction=(0.5, draw(signed), -1.0)))
    return tuple(found)


@st.composite
def tolerances(draw, kinds, ids):
    leaf = draw(st.sampled_from(sorted(CHARACTERISTICS)))
    zone = draw(zones())
    scope = draw(
        st.sampled_from(["feature", "feature", "feature", "all_around", "between", "all_over", "general"])
    )
    feature = FeatureSelection()
    if scope not in ("general",):
        feature = draw(face_selections(kinds))
        centre = draw(st.booleans()) if scope == "feature" else False
        derived = inferred_derived(leaf, zone.shape, feature.kinds, feature, centre=centre)
        if derived == "median_plane" and all(len(group) == 1 for group in feature.groups):
            feature = replace(feature, groups=())
        feature = replace(feature, derived=derived)
        if scope == "feature" and len(feature.groups) > 1:
            scope = "pattern"
    modifiers = st.sampled_from(sorted(set(TOLERANCE_MODIFIERS) - _ZONE_WORDS))
    in_inch = draw(st.booleans())
    raw = draw(st.decimals("0.0001", "9", places=4).map(float))
    return Tolerance(
        id=f"t{len(ids)}",
        type=leaf,
        value=float(f"{raw * 25.4:.15g}") if in_inch else draw(st.none() | st.floats(0, 1e4)),
        feature=feature,
        scope=scope,
        datums=draw(datum_systems),
        material=draw(st.sampled_from(["RFS", "MMR", "LMR"])),
        modifiers=tuple(draw(st.lists(modifiers, max_size=2, unique=True))),
        zone=zone,
        indicators=draw(plane_indicators()),
        parent=draw(st.none() | st.sampled_from(ids)) if ids else None,
        name=draw(texts),
        raw_value=raw if in_inch else None,
        raw_unit="inch" if in_inch else None,
    )


@st.composite
def datum_targets(draw, letter, number, kinds):
    directions = st.sampled_from([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (0.6, 0.8, 0.0)])
    origin = draw(st.none() | st.tuples(signed, signed, signed))
    placed = origin is not None
    faces = st.just(FeatureSelection()) | face_selections(kinds, grouped=False)
    return DatumTarget(
        label=f"{letter}{number}",
        kind=draw(st.sampled_from(["point", "line", "rectangle", "circle", "circular_curve", "area"])),
        origin=origin,
        axis=draw(st.none() | directions) if placed else None,
        direction=draw(st.none() | directions) if placed else None,
        length=draw(maybe_length),
        width=draw(maybe_length),
        diameter=draw(maybe_length),
        feature=draw(faces),
        movable=draw(st.booleans()),
    )


@st.composite
def datums(draw, letter, kinds):
    feature = draw(st.just(FeatureSelection()) | face_selections(kinds))
    count = draw(st.integers(0, 2))
    return Datum(letter, feature, tuple(draw(datum_targets(letter, i + 1, kinds)) for i in range(count)))


@st.composite
def dimensions(draw, number, kinds):
    kind = draw(st.sampled_from(["size", "size", "location", "angular_size", "angular_location"]))
    angular = kind.startswith("angular")
    nominal = draw(st.none() | (st.floats(0.01, 3.0) if angular else st.floats(1.0, 499.0)))
    low = high = fit = None
    if nominal is not None and not angular and draw(st.booleans()):
        fit = draw(st.sampled_from(["H7", "g6", "JS9", "p6", "N7", "D10", "h11", "za6", "ZB8"]))
        low, high = (clean_sum(nominal, deviation) for deviation in fit_deviations(nominal, fit))
    elif draw(st.booleans()):
        low, high = sorted([draw(st.floats(0, 600)), draw(st.floats(0, 600))])
    elif draw(st.booleans()):
        high = draw(st.floats(0, 600))
    second = draw(face_selections(kinds)) if kind.endswith("location") else FeatureSelection()
    return Dimension(
        id=f"d{number}",
        kind=kind,
        name=draw(texts),
        nominal=nominal,
        lower=low,
        upper=high,
        feature=draw(face_selections(kinds)),
        second=second,
        fit=fit,
        qualifier=draw(st.sampled_from(["none", "basic", "reference"])),
        modifiers=tuple(
            draw(
                st.lists(
                    st.sampled_from(["envelope requirement", "statistical", "square"]),
                    max_size=2,
                    unique=True,
                )
            )
        ),
    )


@st.composite
def specifications(draw, kinds):
    """A specification on a part whose faces have these kinds; contradictions are welcome."""
    found = []
    for _ in range(draw(st.integers(0, 3))):
        found.append(draw(tolerances(kinds, [item.id for item in found])))
    return Specification(
        *found,
        datums=tuple(draw(datums(letter, kinds)) for letter in LETTERS),
        dimensions=tuple(draw(dimensions(i, kinds)) for i in range(draw(st.integers(0, 2)))),
        checked=False,
    )


# -- what a spec file can hold beyond AP242 --------------------

_plain = st.recursive(
    st.booleans() | st.integers(-(2**40), 2**40) | st.floats(allow_nan=False, allow_infinity=False) | texts,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3),
    max_leaves=5,
)
selectors = st.lists(st.integers(0, 999) | texts, min_size=1, max_size=3).map(
    lambda words: FeatureSelection(selectors=tuple(words))
)


@st.composite
def file_specifications(draw):
    """A specification with selectors, models, a default, parts and unresolved items."""
    spec = draw(specifications(("plane", "cylinder", "plane", "sphere")))
    changed = [
        replace(
            item,
            feature=draw(selectors)
            if draw(st.booleans())
            else replace(item.feature, part=draw(st.none() | texts)),
            indicators=draw(indicators()),
            model=draw(st.none() | st.dictionaries(texts, _plain, max_size=3)),
            standard=draw(st.none() | st.sampled_from(["ISO", "ASME"])),
            id=draw(st.sampled_from([f"#{item.id}", f"#{item.type}-1"])),
        )
        for item in spec.tolerances
    ]
    ids = [item.id for item in changed]
    changed = [
        replace(item, id=f"{item.id}-{i}" if ids.count(item.id) > 1 else item.id)
        for i, item in enumerate(changed)
    ]
    unresolved = draw(st.lists(st.builds(Unresolved, texts, texts, texts), max_size=2))
    default = draw(st.none() | tolerances(("plane",), []).map(lambda item: replace(item, id="#general")))
    triple = st.tuples(signed, signed, signed)
    prints = st.builds(
        FaceFingerprint,
        kind=st.sampled_from(["plane", "cone"]),
        internal=st.booleans(),
        area=lengths,
        centre=triple,
        normal=triple,
        axis=st.none() | triple,
        radius=maybe_length,
        size=maybe_length,
    )
    records = st.lists(st.builds(FaceRecord, st.none() | texts, st.integers(0, 99), prints), max_size=2)
    return Specification(
        *changed,
        fingerprints=draw(records),
        datums=spec.datums,
        dimensions=spec.dimensions,
        default=default,
        unresolved=unresolved,
        checked=False,
    )
