"""Faces: picked, refused, noticed when they move."""

from __future__ import annotations

import unittest

import FreeCAD
from freecad.CadSkin import api
from freecad.CadSkin.datum import letters_in
from freecad.CadSkin.faces import InputError, check_faces, face_numbers
from freecad.CadSkin.signature import pack, shape_signatures, signature, unpack

from .support import DocumentTest, box_shape


class Picking(DocumentTest):
    def test_what_is_no_face_is_refused_and_nothing_is_left(self):
        part = self.plate()
        count = len(self.document.Objects)
        for names, text in (
            ([], "nothing is picked"),
            (["Edge1"], "Edge1 is no face"),
            (["Vertex2"], "no face"),
            ([""], "the whole part is no face"),
            (["Face99"], "has no Face99"),
            (["?Face3"], "no face"),
        ):
            with self.assertRaisesRegex(InputError, text):
                api.add_tolerance(part, names, "flatness", 0.1)
        self.assertEqual(len(self.document.Objects), count)

    def test_a_value_must_be_above_zero(self):
        part = self.plate()
        for value in (0, -0.1):
            with self.assertRaisesRegex(InputError, "above 0"):
                api.add_tolerance(part, "Face1", "flatness", value)
            with self.assertRaisesRegex(InputError, "above 0"):
                api.general_tolerance(part, value)

    def test_what_the_property_editor_lets_through_is_noticed(self):
        part = self.plate()
        made = api.add_tolerance(part, self.face(part, z=6), "flatness", 0.1)
        skin = api.create_skin(part)
        for name, value, text in (
            ("Value", 0, "its value is 0"),
            ("Characteristic", "cylindricity", "no meaning on a Plane"),
            ("Datums", "A", "has no datum"),
            ("ZoneShare", -1.0, "must not be negative"),
            ("Extra", "[]", "no JSON table"),
        ):
            before = getattr(made, name)
            setattr(made, name, value)
            self.document.recompute()
            self.assertIn(text, made.Status)
            with self.assertRaisesRegex(InputError, f"Flatness: .*{text}"):
                api.compute(skin)
            setattr(made, name, before)
        self.document.recompute()
        self.assertEqual((made.Status, skin.Status), ("OK", "Not computed"))

    def test_a_characteristic_must_suit_the_surface(self):
        part = self.plate()
        bore = self.face(part, kind="Cylinder")
        with self.assertRaisesRegex(InputError, "flatness has no meaning on a Cylinder"):
            api.add_tolerance(part, bore, "flatness", 0.1)
        with self.assertRaisesRegex(InputError, "flatnes"):
            api.add_tolerance(part, bore, "flatnes", 0.1)
        with self.assertRaisesRegex(InputError, "needs a datum"):
            api.add_tolerance(part, bore, "perpendicularity", 0.1)
        with self.assertRaisesRegex(InputError, "no datum Q"):
            api.add_tolerance(part, bore, "perpendicularity", 0.1, datums="Q")
        self.assertNotIn("flatness", api.characteristics_for(["Plane", "Cylinder"]))

    def test_a_part_with_an_error_and_one_without_shape(self):
        part = self.plate()
        empty = self.document.addObject("App::FeaturePython", "Nothing")
        with self.assertRaisesRegex(InputError, "has no shape"):
            api.add_tolerance(empty, "Face1", "flatness", 0.1)
        part.Tool = None
        self.document.recompute()
        with self.assertRaisesRegex(InputError, "has an error|is empty"):
            api.create_skin(part)

    def test_two_solids_are_no_part(self):
        one, two = self.plate(hole=False), self.plate(hole=False)
        two.Placement.Base = FreeCAD.Vector(100, 0, 0)
        both = self.document.addObject("Part::Compound", "Both")
        both.Links = [one, two]
        self.document.recompute()
        with self.assertRaisesRegex(InputError, "2 solids"):
            api.create_skin(both)

    def test_a_body_is_the_part_of_its_last_feature(self):
        body = self.document.addObject("PartDesign::Body", "Body")
        box = body.newObject("PartDesign::AdditiveBox", "Feature")
        self.document.recompute()
        made = api.add_tolerance(box, "Face1", "flatness", 0.1)
        self.assertEqual(made.Faces[0], body)

    def test_datum_letters(self):
        part = self.plate()
        first = api.add_datum(part, self.face(part, z=0))
        self.assertEqual(first.Letter, "A")
        self.assertEqual(api.add_datum(part, "Face1").Letter, "B")
        with self.assertRaisesRegex(InputError, "datum A already"):
            api.add_datum(part, "Face2", "A")
        with self.assertRaisesRegex(InputError, "no datum letter"):
            api.add_datum(part, "Face2", "1")
        self.assertEqual(letters_in("A|B-C(M)|D[SL]"), ["A", "B", "C", "D"])


class Moving(DocumentTest):
    def drilled(self):
        part = self.plate()
        made = api.add_tolerance(part, self.face(part, kind="Cylinder"), "cylindricity", 0.05)
        self.assertEqual(made.Status, "OK")
        return part, made

    def test_a_moved_part_has_the_same_faces(self):
        part, made = self.drilled()
        part.Placement = FreeCAD.Placement(FreeCAD.Vector(50, 0, 9), FreeCAD.Rotation(30, 20, 10))
        self.document.recompute()
        self.assertEqual(made.Status, "OK")

    def test_a_face_that_came_to_another_number_is_noticed_and_found(self):
        part, made = self.drilled()
        before = part.Base
        notch = self.document.addObject("Part::Box", "Notch")
        notch.Length, notch.Width, notch.Height = 3, 3, 20
        notched = self.document.addObject("Part::Cut", "Notched")
        notched.Base, notched.Tool = before, notch
        part.Base = notched
        self.document.recompute()
        wanted = int(self.face(part, kind="Cylinder")[4:])
        moved = face_numbers(made) != [wanted]
        if moved:  # FreeCAD before 1.0
            self.assertIn(f"the one that was picked is Face{wanted}", made.Status)
            skin = api.create_skin(part)
            with self.assertRaisesRegex(InputError, "cannot be computed"):
                api.compute(skin)
            self.assertTrue(api.find_faces(made))
        self.assertEqual(made.Status, "OK")
        self.assertEqual(face_numbers(made), [wanted])

    def test_a_face_that_is_gone_is_noticed(self):
        part, made = self.drilled()
        part.Tool.Placement.Base = FreeCAD.Vector(200, 0, 0)
        self.document.recompute()
        self.assertNotEqual(made.Status, "OK")
        self.assertFalse(api.find_faces(made))

    def test_another_size_must_be_accepted(self):
        part, made = self.drilled()
        part.Tool.Radius = 5
        self.document.recompute()
        self.assertIn("another size or place", made.Status)
        api.accept_faces(made)
        self.assertEqual(made.Status, "OK")

    def test_a_lost_face_of_later_versions_counts_as_broken(self):
        part, made = self.drilled()
        made.Faces = (part, ["?Face7"])
        self.assertIn("Face7 is gone", check_faces(made))
        self.assertEqual(face_numbers(made), [])

    def test_a_deleted_part_is_noticed(self):
        part, made = self.drilled()
        self.document.removeObject(part.Name)
        made.touch()
        self.document.recompute()
        self.assertIn("the part is gone", made.Status)


class Signatures(unittest.TestCase):
    def test_they_come_back_from_text(self):
        found = shape_signatures(box_shape())
        self.assertEqual(unpack(pack(found)), found)

    def test_a_copy_has_the_faces_in_the_same_order(self):
        shape = box_shape()
        self.assertEqual([signature(face) for face in shape.copy().Faces], shape_signatures(shape))
