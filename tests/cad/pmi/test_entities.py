"""Each way in which exporters write PMI, one by one, on a few hand-written faces."""

import math

import pytest

from cadskin.cad.pmi.part21 import Part21File
from cadskin.cad.pmi.pmi import _NumberedPart
from cadskin.cad.pmi.read import specification_of
from cadskin.errors import CadskinWarning

# Faces: #110 z = 0, #111 z = 10, #112 and #113 halves of the hole x² + y² = 4 (axis z), #114 a hole at
# x = 20, #115 a sphere, #116 and #117 x = -5 and x = 5.
GEOMETRY = """
#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#2=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#3=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#1,#2))REPRESENTATION_CONTEXT('',''));
#4=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#1);
#5=(CONVERSION_BASED_UNIT('INCH',#4)LENGTH_UNIT()NAMED_UNIT(#6));
#6=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#7=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925199433),#2);
#8=(CONVERSION_BASED_UNIT('DEGREE',#7)NAMED_UNIT(#6)PLANE_ANGLE_UNIT());
#9=PRODUCT_DEFINITION_SHAPE('','',#10);
#10=PRODUCT_DEFINITION('','',$,$);
#11=ADVANCED_BREP_SHAPE_REPRESENTATION('',(),#3);
#20=DIRECTION('',(0.,0.,1.));
#21=DIRECTION('',(1.,0.,0.));
#30=CARTESIAN_POINT('',(0.,0.,0.));
#31=CARTESIAN_POINT('',(0.,0.,10.));
#32=CARTESIAN_POINT('',(20.,0.,0.));
#33=CARTESIAN_POINT('',(-5.,0.,0.));
#34=CARTESIAN_POINT('',(5.,0.,0.));
#40=AXIS2_PLACEMENT_3D('',#30,#20,#21);
#41=AXIS2_PLACEMENT_3D('',#31,#20,#21);
#42=AXIS2_PLACEMENT_3D('',#32,#20,#21);
#43=AXIS2_PLACEMENT_3D('',#33,#21,$);
#44=AXIS2_PLACEMENT_3D('',#34,#21,$);
#50=PLANE('',#40);
#51=PLANE('',#41);
#52=CYLINDRICAL_SURFACE('',#40,2.);
#53=CYLINDRICAL_SURFACE('',#41,2.);
#54=CYLINDRICAL_SURFACE('',#42,3.);
#55=SPHERICAL_SURFACE('',#40,7.);
#56=PLANE('',#43);
#57=PLANE('',#44);
#60=VERTEX_POINT('',#61);
#61=CARTESIAN_POINT('',(2.,0.,0.));
#62=CIRCLE('',#40,2.);
#63=EDGE_CURVE('',#60,#60,#62,.T.);
#64=ORIENTED_EDGE('',*,*,#63,.T.);
#65=EDGE_LOOP('',(#64));
#66=FACE_BOUND('',#65,.T.);
#110=ADVANCED_FACE('bottom',(#66),#50,.F.);
#111=ADVANCED_FACE('top',(),#51,.T.);
#112=ADVANCED_FACE('',(#66),#52,.F.);
#113=ADVANCED_FACE('',(),#53,.F.);
#114=ADVANCED_FACE('',(),#54,.F.);
#115=ADVANCED_FACE('',(),#55,.F.);
#116=ADVANCED_FACE('',(),#56,.F.);
#117=ADVANCED_FACE('',(),#57,.F.);
#120=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.1),#1);
"""
HEAD = "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF'));\n"
HEAD += "ENDSEC;\nDATA;\n"
PART = _NumberedPart("part", (110, 111, 112, 113, 114, 115, 116, 117))


def read(lines, parts=(PART,)):
    text = HEAD + GEOMETRY + lines + "\nENDSEC;\nEND-ISO-10303-21;\n"
    return specification_of(Part21File(text.encode("latin-1"), "part.stp"), parts)


def aspect(*faces, number=200):
    """An aspect on faces."""
    lines = f"#{number}=SHAPE_ASPECT('','',#9,.T.);"
    for i, face in enumerate(faces, start=1):
        lines += f"#{number + i}=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#{number},#11,#{face});"
    return lines


def flat(item_lines, target=200):
    """The one flatness on a target."""
    (found,) = read(item_lines + f"#900=FLATNESS_TOLERANCE('','',#120,#{target});")
    return found


# -- values and units --------------------


@pytest.mark.parametrize(
    ("magnitude", "value", "raw", "unit"),
    [
        ("#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.2),#1);", 0.2, 0.2, "mm"),
        ("#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(.2),#1);", 0.2, 0.2, "mm"),  # no Part 21 number
        ("#901=LENGTH_MEASURE_WITH_UNIT(POSITIVE_LENGTH_MEASURE(0.03),#5);", 0.762, 0.03, "inch"),
        ("#901=MEASURE_WITH_UNIT(LENGTH_MEASURE(2),#5);", 50.8, 2.0, "inch"),
        ("#901=MEASURE_WITH_UNIT(0.1,#1);", 0.1, 0.1, "mm"),  # untyped, as OCCT writes it
        ("#901=(LENGTH_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT(LENGTH_MEASURE(0.005),#5)"
         "REPRESENTATION_ITEM(''));", 0.127, 0.005, "inch"),
        ("#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.),#1);", 0.0, 0.0, "mm"),
        ("#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-4),#902);\n"
         "#902=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));", 0.1, 1e-4, "m"),
        ("#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(50.),#902);\n"
         "#902=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MICRO.,.METRE.));", 0.05, 50.0, "µm"),
        ("#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E999),#1);", None, None, None),
        ("#901=LENGTH_MEASURE_WITH_UNIT($,#1);", None, None, None),
        ("", None, None, None),
    ],
)  # fmt: skip
def test_magnitudes_in_every_spelling(magnitude, value, raw, unit):
    spec = read(aspect(110) + magnitude + "#900=FLATNESS_TOLERANCE('','',#901,#200);")
    (found,) = spec
    assert (found.value, found.raw_value, found.raw_unit) == (value, raw, unit)
    if value is None:
        assert any("not understood" in note for note in found.notes)


def test_an_unset_magnitude_is_none_not_zero():
    (found,) = read(aspect(110) + "#900=FLATNESS_TOLERANCE('','',$,#200);")
    assert found.value is None


def test_a_unit_that_refers_to_itself():
    lines = "#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.),#902);\n"
    lines += "#902=(CONVERSION_BASED_UNIT('X',#901)LENGTH_UNIT()NAMED_UNIT(*));"
    (found,) = read(aspect(110) + lines + "#900=FLATNESS_TOLERANCE('','',#901,#200);")
    assert found.value is not None


def test_mixed_units_warn():
    lines = "#901=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.06),#5);"
    lines += "#900=FLATNESS_TOLERANCE('','',#901,#200);#902=FLATNESS_TOLERANCE('','',#120,#200);"
    with pytest.warns(
        CadskinWarning, match=r"mixes length units: 1 in inch \(first #900\), 1 in mm \(first #902\)"
    ):
        spec = read(aspect(110) + lines)
    assert "mixes length units" in spec.notes[0]


# -- targets --------------------


def test_a_face():
    found = flat(aspect(111))
    assert (found.feature.faces, found.feature.step_faces, found.scope) == ((1,), (111,), "feature")
    assert found.feature.kinds == ("plane",)


def test_two_halves_are_one_feature():
    found = flat(aspect(112, 113))
    assert (found.feature.faces, found.feature.groups, found.scope) == ((2, 3), (), "feature")


HALVES = aspect(112, number=200) + aspect(113, number=210) + aspect(114, number=220)


@pytest.mark.parametrize("kind", ["COMPOSITE_SHAPE_ASPECT", "COMPOSITE_GROUP_SHAPE_ASPECT"])
def test_a_composite_of_halves_and_another_hole_is_a_pattern_of_two(kind):
    lines = HALVES + f"#230={kind}('','multiple elements',#9,.T.);"
    lines += "".join(f"#{240 + i}=SHAPE_ASPECT_RELATIONSHIP('','',#230,#{200 + 10 * i});" for i in range(3))
    found = flat(lines, 230)
    assert found.feature.groups == ((2, 3), (4,))
    assert found.scope == "pattern"


def test_a_stated_pattern_keeps_its_members():
    lines = HALVES + "#230=COMPOSITE_GROUP_SHAPE_ASPECT('','pattern of features',#9,.T.);"
    lines += "".join(f"#{240 + i}=SHAPE_ASPECT_RELATIONSHIP('','',#230,#{200 + 10 * i});" for i in range(3))
    assert flat(lines, 230).feature.groups == ((2,), (3,), (4,))


def test_a_united_feature_is_one():
    lines = HALVES + "#230=COMPOSITE_SHAPE_ASPECT('','unified geometric item',#9,.T.);"
    lines += "".join(f"#{240 + i}=SHAPE_ASPECT_RELATIONSHIP('','',#230,#{200 + 10 * i});" for i in range(3))
    found = flat(lines, 230)
    assert (found.feature.faces, found.feature.groups, found.scope) == ((2, 3, 4), (), "feature")


def test_nested_composites():
    lines = (
        HALVES + "#230=COMPOSITE_SHAPE_ASPECT('','',#9,.T.);#231=COMPOSITE_GROUP_SHAPE_ASPECT('','',#9,.T.);"
    )
    lines += (
        "#240=SHAPE_ASPECT_RELATIONSHIP('','',#230,#200);#241=SHAPE_ASPECT_RELATIONSHIP('','',#230,#210);"
    )
    lines += (
        "#242=SHAPE_ASPECT_RELATIONSHIP('','',#231,#230);#243=SHAPE_ASPECT_RELATIONSHIP('','',#231,#220);"
    )
    assert flat(lines, 231).feature.groups == ((2, 3), (4,))


def test_a_composite_whose_relations_are_turned_round():
    lines = HALVES + "#230=COMPOSITE_SHAPE_ASPECT('','',#9,.T.);"
    lines += "".join(f"#{240 + i}=SHAPE_ASPECT_RELATIONSHIP('','',#{200 + 10 * i},#230);" for i in range(3))
    assert flat(lines, 230).feature.faces == (2, 3, 4)


def test_composites_that_hold_each_other():
    lines = (
        aspect(110) + "#230=COMPOSITE_SHAPE_ASPECT('','',#9,.T.);#231=COMPOSITE_SHAPE_ASPECT('','',#9,.T.);"
    )
    lines += (
        "#240=SHAPE_ASPECT_RELATIONSHIP('','',#230,#231);#241=SHAPE_ASPECT_RELATIONSHIP('','',#231,#230);"
    )
    lines += (
        "#242=SHAPE_ASPECT_RELATIONSHIP('','',#231,#200);#243=SHAPE_ASPECT_RELATIONSHIP('','',#230,#230);"
    )
    assert flat(lines, 230).feature.faces == (0,)


@pytest.mark.parametrize(
    ("kind", "scope"), [("ALL_AROUND_SHAPE_ASPECT", "all_around"), ("BETWEEN_SHAPE_ASPECT", "between")]
)
def test_scopes_by_the_kind_of_aspect(kind, scope):
    lines = HALVES + f"#230={kind}('','',#9,.T.);#240=SHAPE_ASPECT_RELATIONSHIP('','',#230,#200);"
    lines += "#241=SHAPE_ASPECT_RELATIONSHIP('','',#230,#220);"
    assert flat(lines, 230).scope == scope


def test_the_whole_part_is_general():
    found = flat("", 9)
    assert (found.scope, found.feature.faces) == ("general", ())


def test_an_empty_aspect_is_general_for_a_profile_and_unresolved_for_others():
    spec = read(
        "#200=SHAPE_ASPECT('general note','',#9,.T.);#900=SURFACE_PROFILE_TOLERANCE('','',#120,#200);"
        "#901=FLATNESS_TOLERANCE('','',#120,#200);"
        "#902=(FLATNESS_TOLERANCE()GEOMETRIC_TOLERANCE('','',#120,#200)"
        "GEOMETRIC_TOLERANCE_AUXILIARY_CLASSIFICATION((.UNLESS_OTHERWISE_SPECIFIED.)));"
    )
    assert [t.scope for t in spec] == ["general", "feature", "general"]
    assert [(u.entity, u.reason) for u in spec.unresolved] == [
        ("#901", "its aspect has no geometry in the file")
    ]


def test_all_over():
    lines = (
        "#902=(GEOMETRIC_TOLERANCE('','',#120,#9)GEOMETRIC_TOLERANCE_AUXILIARY_CLASSIFICATION((.ALL_OVER.))"
    )
    (found,) = read(lines + "SURFACE_PROFILE_TOLERANCE());")
    assert found.scope == "all_over"


def on_item(item, leaf="POSITION", zone=None):
    """A tolerance on another item than a face."""
    lines = f"#200=SHAPE_ASPECT('','',#9,.T.);#201=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#200,#11,#300);{item}"
    lines += f"#900={leaf}_TOLERANCE('','',#120,#200);"
    if zone:
        lines += f"#910=TOLERANCE_ZONE_FORM('{zone}');#911=TOLERANCE_ZONE('','',#9,.F.,(#900),#910);"
    spec = read(lines)
    return spec.tolerances[0], spec.unresolved


LINE = "#302=LINE('',#30,#303);#303=VECTOR('',#20,1.);"
AWAY = "#302=LINE('',#304,#303);#303=VECTOR('',#21,1.);#304=CARTESIAN_POINT('',(0.,7.,99.));"


@pytest.mark.parametrize(
    "item",
    [
        f"#300=TRIMMED_CURVE('',#302,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(10.)),.T.,.PARAMETER.);{LINE}",
        "#300=LINE('',#30,#303);#303=VECTOR('',#20,1.);",
        "#300=POLYLINE('',(#30,#31));",
        "#300=CIRCLE('',#41,1.);",
        "#300=AXIS2_PLACEMENT_3D('',#31,#20,$);",
        f"#300=GEOMETRIC_CURVE_SET('',(#301));#301=TRIMMED_CURVE('',#302,(#30),(#31),.T.,.CARTESIAN.);{LINE}",
    ],
)
def test_an_axis_means_the_coaxial_cylinders(item):
    found, unresolved = on_item(item, zone="cylindrical or circular")
    assert found.feature.step_faces == (112, 113)
    assert found.feature.derived == "axis"
    assert found.notes[0] == f"faces found through {'curve' if 'SET' in item else 'axis'}"
    assert unresolved == ()


def test_the_rim_of_a_hole():
    found, _ = on_item("#300=EDGE_CURVE('',#60,#60,#62,.T.);", zone="cylindrical or circular")
    assert found.feature.step_faces == ()  # an edge that no face has
    lines = "#200=SHAPE_ASPECT('','',#9,.T.);#201=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#200,#11,#63);"
    lines += (
        "#910=TOLERANCE_ZONE_FORM('cylindrical or circular');#911=TOLERANCE_ZONE('','',#9,.F.,(#900),#910);"
    )
    (axis,) = read(lines + "#900=POSITION_TOLERANCE('','',#120,#200);")
    assert axis.feature.step_faces == (112,)
    (surface,) = read(lines.partition("#910")[0] + "#900=LINE_PROFILE_TOLERANCE('','',#120,#200);")
    assert surface.feature.step_faces == (110, 112)


def test_a_surface_and_a_whole_body():
    assert on_item("#300=CYLINDRICAL_SURFACE('',#40,2.);")[0].feature.step_faces == ()
    lines = "#200=SHAPE_ASPECT('','',#9,.T.);#201=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#200,#11,#{});"
    lines += "#900=FLATNESS_TOLERANCE('','',#120,#200);#300=MANIFOLD_SOLID_BREP('',#301);"
    lines += "#301=CLOSED_SHELL('',(#110,#111));"
    assert read(lines.format(51)).tolerances[0].feature.step_faces == (111,)
    assert read(lines.format(300)).tolerances[0].feature.step_faces == (110, 111)


@pytest.mark.parametrize(
    "item",
    [
        f"#300=TRIMMED_CURVE('',#302,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.);{AWAY}",
        "#300=TRIMMED_CURVE('',#300,(),(),.T.,.PARAMETER.);",
        "#300=CARTESIAN_POINT('',(1.,2.,3.));",
        "#300=TESSELLATED_FACE();",
        "",
    ],
)
def test_what_no_face_is_found_for_is_listed(item):
    found, unresolved = on_item(item)
    assert found.feature.step_faces == ()
    assert unresolved[0].entity == "#900"
    assert "no face found for" in unresolved[0].reason


def test_dangling_and_missing_targets():
    spec = read(
        "#900=FLATNESS_TOLERANCE('','',#120,#777);#901=FLATNESS_TOLERANCE('','',#120,$);#902=FLATNESS_TOLERANCE();"
    )
    assert len(spec) == 3
    reasons = {u.entity: u.reason for u in spec.unresolved}
    assert reasons["#900"] == "#777 is not in the file"
    assert reasons["#901"] == reasons["#902"] == "it refers to nothing"


def test_a_tolerance_without_a_leaf_is_listed():
    spec = read(
        aspect(110) + "#900=(GEOMETRIC_TOLERANCE('','',#120,#200)GEOMETRIC_TOLERANCE_WITH_MODIFIERS(()));"
    )
    assert len(spec) == 0
    assert "no characteristic" in spec.unresolved[0].reason


def test_derived_features():
    centre = "#230=CENTRE_OF_SYMMETRY('','',#9,.F.);#231=SHAPE_ASPECT_DERIVING_RELATIONSHIP('','',#230,#200);"
    assert flat(aspect(116, 117) + centre, 230).feature.derived == "median_plane"
    assert flat(aspect(112, 113) + centre, 230).feature.derived == "axis"
    assert flat(aspect(115) + centre, 230).feature.derived == "centre_point"
    assert flat(aspect(112, 113)).feature.derived == "none"
    size = "#230=DIMENSIONAL_SIZE(#200,'diameter');"
    assert flat(aspect(112, 113) + size, 230).feature.derived == "axis"


def test_faces_beside_the_part():
    lines = aspect(110, 111) + "#900=FLATNESS_TOLERANCE('','',#120,#200);"
    (found,) = read(lines, [_NumberedPart("part", (None, 111))])
    assert (found.feature.faces, found.feature.step_faces) == ((1,), (110, 111))
    assert "1 of 2 faces are not on the part (supplemental geometry): #110" in found.notes


def test_the_part_that_has_the_faces():
    lines = aspect(110) + "#900=FLATNESS_TOLERANCE('','',#120,#200);"
    (found,) = read(lines, [_NumberedPart("lid", (111,)), _NumberedPart("box", (112, 110))])
    assert (found.feature.part, found.feature.faces) == ("box", (1,))


# -- modifiers, zones, datums --------------------


def test_modifiers_old_and_new():
    base = aspect(112, 113)
    new = "#900=(GEOMETRIC_TOLERANCE('','',#120,#200)GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.FREE_STATE.,"
    new += ".MAXIMUM_MATERIAL_REQUIREMENT.,.COMMON_ZONE.))POSITION_TOLERANCE());"
    (found,) = read(base + new)
    assert (found.material, found.modifiers, found.zone.combined) == (
        "MMR",
        ("FREE_STATE", "COMMON_ZONE"),
        True,
    )
    old = "#900=(GEOMETRIC_TOLERANCE('','',#120,#200)MODIFIED_GEOMETRIC_TOLERANCE(.LEAST_MATERIAL_CONDITION.)"
    assert read(base + old + "POSITION_TOLERANCE());").tolerances[0].material == "LMR"


def test_zone_definitions():
    lines = aspect(112, 113) + "#900=CIRCULAR_RUNOUT_TOLERANCE('','',#120,#200,());"
    lines += "#901=POSITION_TOLERANCE('','',#120,#200);"
    lines += "#910=TOLERANCE_ZONE_FORM('unknown');#911=TOLERANCE_ZONE('','',#9,.F.,(#900),#910);"
    lines += "#912=RUNOUT_ZONE_DEFINITION(#911,(),#913);#913=RUNOUT_ZONE_ORIENTATION(#914);"
    lines += "#914=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(30.),#8);"
    lines += "#920=TOLERANCE_ZONE_FORM('within a cylinder');#921=TOLERANCE_ZONE('','',#9,.F.,(#901),#920);"
    lines += "#922=PROJECTED_ZONE_DEFINITION(#921,(),#200,#923);"
    lines += "#923=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.5),#5);"
    runout, position = read(lines)
    assert runout.zone.angle == pytest.approx(math.radians(30))
    assert (position.zone.shape, position.zone.form, position.zone.projected) == (
        "diameter",
        "within a cylinder",
        12.7,
    )


DATUMS = """#300=DATUM_FEATURE('','',#9,.T.);#301=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#300,#11,#110);
#302=DATUM('','',#9,.F.,'A');#303=SHAPE_ASPECT_RELATIONSHIP('','',#300,#302);
#310=DATUM_FEATURE('','',#9,.T.);#311=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#310,#11,#116);
#312=DATUM('','',#9,.F.,'B');#313=SHAPE_ASPECT_RELATIONSHIP('','',#310,#312);
#320=DATUM('','',#9,.F.,'C');#321=SHAPE_ASPECT_RELATIONSHIP('','',#320,#322);
#322=DATUM_FEATURE('','',#9,.T.);#323=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#322,#11,#117);
"""


def with_system(lines, reference="#400"):
    tolerance = f"#900=PERPENDICULARITY_TOLERANCE('','',#120,#200,({reference}));"
    return read(aspect(111) + DATUMS + lines + tolerance)


def test_datums_whichever_way_they_are_related():
    spec = with_system("#400=DATUM_SYSTEM('','',#9,.F.,());")
    assert [(d.letter, d.feature.faces) for d in spec.datums] == [("A", (0,)), ("B", (6,)), ("C", (7,))]


def test_a_datum_system_with_modifiers_and_a_common_datum():
    spec = with_system(
        "#400=DATUM_SYSTEM('','',#9,.F.,(#401,#402));"
        "#401=DATUM_REFERENCE_COMPARTMENT('','',#9,.F.,#302,(SIMPLE_DATUM_REFERENCE_MODIFIER(.FREE_STATE.),#405));"
        "#402=DATUM_REFERENCE_COMPARTMENT('','',#9,.F.,COMMON_DATUM_LIST((#403,#404)),$);"
        "#403=DATUM_REFERENCE_ELEMENT('','',#9,.F.,#312,(SIMPLE_DATUM_REFERENCE_MODIFIER("
        ".MAXIMUM_MATERIAL_REQUIREMENT.)));#404=DATUM_REFERENCE_ELEMENT($,$,$,.F.,#320,$);"
        "#405=DATUM_REFERENCE_MODIFIER_WITH_VALUE(.PROJECTED.,#120);"
    )
    (found,) = spec
    assert found.datums.labels == ("A", "B-C")
    assert found.datums.text() == "A(FREE_STATE,PROJECTED=0.1)|[B(MAXIMUM_MATERIAL_REQUIREMENT)-C]"


def test_complex_compartments():
    spec = with_system(
        "#400=(DATUM_SYSTEM((#401))SHAPE_ASPECT('','',#9,.F.));"
        "#401=(DATUM_REFERENCE_COMPARTMENT()GENERAL_DATUM_REFERENCE(#302,$)SHAPE_ASPECT('','',#9,.F.));"
    )
    assert spec.tolerances[0].datums.labels == ("A",)


def test_references_of_the_first_edition_and_before():
    spec = with_system(
        "#400=DATUM_REFERENCE(2,#302);#401=REFERENCED_MODIFIED_DATUM(1,#312,.MAXIMUM_MATERIAL_CONDITION.);"
        "#402=DATUM_REFERENCE(2,#320);",
        "#400,#401,#402",
    )
    (found,) = spec
    assert found.datums.labels == ("B", "A-C")
    assert found.datums.references[0].modifiers[0].name == "MAXIMUM_MATERIAL_REQUIREMENT"


def test_a_datum_system_that_holds_itself():
    spec = with_system(
        "#400=DATUM_SYSTEM('','',#9,.F.,(#401,#400));#401=DATUM_REFERENCE_COMPARTMENT('','',#9,.F.,"
        "COMMON_DATUM_LIST((#401,#402)),$);#402=DATUM_REFERENCE_ELEMENT('','',#9,.F.,#302,$);"
    )
    assert "A" in spec.tolerances[0].datums.letters


def test_composite_and_other_relations():
    lines = aspect(110) + "".join(f"#{n}=FLATNESS_TOLERANCE('','',#120,#200);" for n in range(900, 904))
    lines += "#910=GEOMETRIC_TOLERANCE_RELATIONSHIP('composite tolerance','',#900,#901);"
    lines += "#911=GEOMETRIC_TOLERANCE_RELATIONSHIP('simultaneity','',#900,#902);"
    lines += "#912=GEOMETRIC_TOLERANCE_RELATIONSHIP('precedence','',#900,#903);"
    assert [t.parent for t in read(lines)] == [None, "#900", None, None]


def test_datum_targets_with_places_and_sizes():
    lines = DATUMS + "#500=PLACED_DATUM_TARGET_FEATURE('','rectangle',#9,.T.,'1');"
    lines += "#501=SHAPE_ASPECT_RELATIONSHIP('','',#500,#302);#502=PROPERTY_DEFINITION('','',#500);"
    lines += "#503=SHAPE_DEFINITION_REPRESENTATION(#502,#504);"
    lines += "#504=SHAPE_REPRESENTATION_WITH_PARAMETERS('',(#42,#505,#506),#3);"
    for number, name in ((505, "length"), (506, "width")):
        lines += f"#{number}=(LENGTH_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT("
        lines += f"LENGTH_MEASURE(2.),#5)REPRESENTATION_ITEM('target {name}'));"
    lines += "#507=FEATURE_FOR_DATUM_TARGET_RELATIONSHIP('','',#300,#500);"
    (target,) = read(lines).datum("A").targets
    assert (target.label, target.kind, target.length, target.width) == ("A1", "rectangle", 50.8, 50.8)
    assert (target.origin, target.axis, target.direction) == ((20, 0, 0), (0, 0, 1), (1, 0, 0))
    assert target.feature.faces == (0,)


def test_a_letter_twice_and_a_datum_without_geometry():
    spec = read(
        DATUMS + "#330=DATUM('','',#9,.F.,'A');#331=SHAPE_ASPECT_RELATIONSHIP('','',#310,#330);"
        "#340=DATUM('','',#9,.F.,'E');"
    )
    reasons = {u.entity: u.reason for u in spec.unresolved}
    assert "defined twice" in reasons["#330"]
    assert "no geometry" in reasons["#340"]


@pytest.mark.parametrize(
    ("documents", "standard"),
    [
        ("#800=PRODUCT('ASME Y14.5','','',());", "ASME"),
        ("#800=DOCUMENT('','ISO 1101','',$);", "ISO"),
        ("#800=PRODUCT('plate','ISO 2768 plate','',());", None),
        ("#800=PRODUCT('ASME Y14.5-2009','','',());#801=DOCUMENT('','ISO 8015','',$);", None),
    ],
)
def test_the_standard_where_the_file_names_one(documents, standard):
    assert flat(aspect(110) + documents).standard == standard


# -- dimensions --------------------


def sized(value_lines, kind="DIMENSIONAL_SIZE(#200,'diameter')"):
    lines = aspect(112, 113) + aspect(110, number=210) + f"#900={kind};"
    lines += "#901=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#900,#902);"
    return read(lines + value_lines).dimensions[0]


def item(number, value, name="nominal value", unit=1, qualifiers=""):
    more = f"QUALIFIED_REPRESENTATION_ITEM(({qualifiers}))" if qualifiers else ""
    measure = "PLANE_ANGLE" if unit in (2, 8) else "LENGTH"
    text = f"#{number}=({measure}_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT("
    return text + f"{measure}_MEASURE({value}),#{unit}){more}REPRESENTATION_ITEM('{name}'));"


NOMINAL = "#902=SHAPE_DIMENSION_REPRESENTATION('',(#903),#3);"


def bound(number, value, unit=1):
    return f"#{number}=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({value}),#{unit});"


def test_signed_deviations_in_another_unit_than_the_nominal():
    found = sized(
        NOMINAL + item(903, "8.") + "#910=PLUS_MINUS_TOLERANCE(#911,#900);#911=TOLERANCE_VALUE(#912,#913);"
        + bound(912, "-0.002", 5) + bound(913, "-0.001", 5)
    )  # fmt: skip
    assert found.deviations == pytest.approx((-0.0508, -0.0254), abs=1e-12)


def test_limits_as_a_range_and_single_limits():
    both = "#902=SHAPE_DIMENSION_REPRESENTATION('',(#903,#904,#905),#3);"
    found = sized(both + item(903, "8.") + item(904, "7.9", "lower limit") + item(905, "8.2", "upper limit"))
    assert (found.nominal, found.lower, found.upper) == (8.0, 7.9, 8.2)
    found = sized(NOMINAL + item(903, "8.", qualifiers="#904") + "#904=TYPE_QUALIFIER('maximum');")
    assert (found.nominal, found.lower, found.upper) == (None, None, 8.0)


@pytest.mark.parametrize(
    ("fit", "name", "high"),
    [
        ("'H','hole','7',''", "H7", 0.015),
        ("'H','hole','IT7',''", "H7", 0.015),
        ("'G6','hole','',''", "G6", 0.014),
    ],
)
def test_fits_in_both_orders(fit, name, high):
    found = sized(
        NOMINAL + item(903, "8.") + f"#910=PLUS_MINUS_TOLERANCE(#911,#900);#911=LIMITS_AND_FITS({fit});"
    )
    assert found.fit == name
    assert found.deviations[1] == pytest.approx(high, abs=1e-12)


def test_qualifiers_and_words():
    lines = "#902=SHAPE_DIMENSION_REPRESENTATION('',(#903,#904),#3);" + item(
        903, "8.", qualifiers="#905,#906"
    )
    lines += "#905=VALUE_FORMAT_TYPE_QUALIFIER('NR2 1.1');#906=TYPE_QUALIFIER('average');"
    lines += "#904=COMPOUND_REPRESENTATION_ITEM('',LIST_REPRESENTATION_ITEM((#907,#908)));"
    lines += "#907=DESCRIPTIVE_REPRESENTATION_ITEM('dimensional note','theoretical');"
    lines += "#908=DESCRIPTIVE_REPRESENTATION_ITEM('dimensional note','envelope requirement');"
    found = sized(lines)
    assert found.qualifier == "basic"
    assert set(found.modifiers) == {"average", "envelope requirement"}
    assert str(found) == "[⌀8]"


def test_angles_are_radians_inside():
    found = sized(NOMINAL + item(903, "60.", unit=8), "ANGULAR_LOCATION('angle','',#200,#210,.SMALL.)")
    assert (found.kind, found.raw_unit) == ("angular_location", "deg")
    assert found.nominal == pytest.approx(math.radians(60))
    assert str(found) == "60°"


def test_a_complex_location_and_a_size_that_is_its_own_datum_feature():
    kind = "(DIMENSIONAL_LOCATION()DIRECTED_DIMENSIONAL_LOCATION()"
    kind += "SHAPE_ASPECT_RELATIONSHIP('linear distance','',#200,#210))"
    found = sized(NOMINAL + item(903, "8."), kind)
    assert (found.name, found.feature.faces, found.second.faces) == ("linear distance", (2, 3), (0,))
    lines = "#900=DIMENSIONAL_SIZE_WITH_DATUM_FEATURE('','',#9,.T.,#900,'diameter');"
    lines += "#901=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#900,#11,#112);"
    (found,) = read(lines).dimensions
    assert (found.name, found.feature.faces, found.nominal) == ("diameter", (2,), None)
    assert "no value" in found.notes[0]


def test_nothing_at_all_and_tessellated_files():
    spec = read("")
    assert spec.unresolved[0].reason.endswith("has no PMI at all; write a spec file")


# -- indicators --------------------

_AFFECTED = """
#300=STRAIGHTNESS_TOLERANCE('','',#120,#200);
#301=TOLERANCE_ZONE_FORM('');
#302=TOLERANCE_ZONE('','',#9,.F.,(#300),#301);
#310=SHAPE_ASPECT('{name}','',#9,.F.);
"""


def affected(link, geometry, *, name=""):
    return read(aspect(111) + _AFFECTED.format(name=name) + link + geometry)


@pytest.mark.parametrize(
    "link",
    [
        "#311=SHAPE_ASPECT_RELATIONSHIP('affected plane association','',#302,#310);",
        "#311=SHAPE_ASPECT_RELATIONSHIP('affected plane association','',#310,#302);",
        "#311=SHAPE_ASPECT_RELATIONSHIP('','affected plane association',#200,#310);",
    ],
)
@pytest.mark.parametrize(
    "geometry",
    [
        "#320=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#310,#11,#117);",
        "#320=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#310,#11,#57);",
        "#320=PROPERTY_DEFINITION('','',#310);#321=SHAPE_REPRESENTATION('',(#44),#3);"
        "#322=SHAPE_DEFINITION_REPRESENTATION(#320,#321);",
    ],
)
def test_an_affected_plane_is_an_indicator_and_no_part_of_the_feature(link, geometry):
    (tolerance,) = affected(link, geometry)
    assert tolerance.feature.step_faces == (111,)
    (plane,) = tolerance.indicators
    assert (plane.kind, plane.relation, plane.direction) == ("intersection_plane", "parallel", (1, 0, 0))


def test_an_affected_plane_is_named_or_given_by_a_line():
    link = "#311=SHAPE_ASPECT_RELATIONSHIP('affected plane association','',#302,#310);"
    line = "#320=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#310,#11,#321);#321=LINE('',#30,#322);"
    line += "#322=VECTOR('',#21,1.);"
    (tolerance,) = affected(link, line, name="orientation plane")
    (plane,) = tolerance.indicators
    assert plane.kind == "orientation_plane"
    assert [abs(x) for x in plane.direction] == [0, 1, 0]  # the plane holds the line (x) and the normal (z)
    (bare,) = affected(link, "")
    assert bare.indicators == ()
    assert bare.notes == ("its affected plane #310 has no direction",)


def test_a_zone_with_a_datum_is_an_indicator():
    system = """
#210=DATUM_FEATURE('','',#9,.T.);
#211=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#210,#11,#110);
#212=DATUM('','',#9,.F.,'A');
#213=SHAPE_ASPECT_RELATIONSHIP('','',#210,#212);
#214=DATUM_REFERENCE_COMPARTMENT('','',#9,.F.,#212,$);
#215=DATUM_SYSTEM('','',#9,.F.,(#214));
#300=STRAIGHTNESS_TOLERANCE('','',#120,#200);
#301=TOLERANCE_ZONE_FORM('');
"""
    for entity, kind in (("ORIENTED", "orientation_plane"), ("DIRECTED", "direction_feature")):
        zone = f"#302={entity}_TOLERANCE_ZONE('','',#9,.F.,(#300),#301,#215,.PERPENDICULAR.);"
        (tolerance,) = read(aspect(111) + system + zone)
        assert [str(x) for x in tolerance.indicators] == [{"o": "◁⟂ A▷", "d": "←⟂ A"}[kind[0]]]
    (broken,) = read(
        aspect(111) + system + "#302=ORIENTED_TOLERANCE_ZONE('','',#9,.F.,(#300),#301,$,.PARALLEL.);"
    )
    assert broken.indicators == ()
    assert "is not understood" in broken.notes[0]
