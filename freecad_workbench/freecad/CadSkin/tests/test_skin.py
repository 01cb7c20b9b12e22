"""The skin model from tolerance to file, with the real worker."""

from __future__ import annotations

import sys
from unittest import mock

import FreeCAD
import numpy as np
from freecad.CadSkin import api, engine, jobs
from freecad.CadSkin.faces import InputError
from freecad.CadSkin.protocol import JobError

from .support import LIMIT, DocumentTest


class SkinTest(DocumentTest):
    def setUp(self):
        super().setUp()
        self.part = self.plate(label="Größe Ø8")
        self.top = self.face(self.part, z=6)
        self.flat = api.add_tolerance(self.part, self.top, "flatness", 0.05)

    def skin(self, **options):
        return api.create_skin(self.part, **{"edge_length": 2.5, "seed": 7, **options})

    def computed(self, **options):
        return api.compute(self.skin(**options), timeout=LIMIT)


class Computing(SkinTest):
    def test_the_mesh_is_the_part_with_its_deviations(self):
        skin = self.computed()
        self.assertEqual(skin.Status, "Up to date")
        self.assertTrue(skin.Mesh.isSolid())
        self.assertAlmostEqual(skin.Mesh.Volume, self.part.Shape.Volume, delta=0.02 * self.part.Shape.Volume)
        found = api.result(skin)
        self.assertEqual(skin.Mesh.CountPoints, found.n_points)
        points = np.array([(p.x, p.y, p.z) for p in skin.Mesh.Points])
        np.testing.assert_allclose(points, found.instance_points(0), atol=1e-5)  # the order of the vertices
        low, high, rms = found.statistics()
        self.assertLess(low, -1e-4)
        self.assertGreater(high, 1e-4)
        self.assertLess(rms, 0.05)
        (row,) = found.tolerance_rows()
        self.assertEqual((row["id"], row["limit"], row["ok"]), (self.flat.Name, 0.05, True))

    def test_deviations_are_on_the_faces_that_they_name(self):
        found = api.result(self.computed())
        number = int(self.top[4:])
        corners = found.triangles[found.triangle_face == number]
        np.testing.assert_allclose(found.points[corners][..., 2], 6.0, atol=1e-9)
        moved = found.displacement[0][corners][..., 2]
        np.testing.assert_allclose(found.face_deviation(number), moved, atol=1e-6)
        bore = int(self.face(self.part, kind="Cylinder")[4:])
        radii = np.linalg.norm(
            found.points[found.triangles[found.triangle_face == bore]][..., :2] - (15, 10), axis=2
        )
        np.testing.assert_allclose(radii, 4.0, atol=1e-6)

    def test_the_seed_makes_the_part(self):
        skin = self.computed()
        first = api.result(skin).displacement
        skin.Seed = 8
        self.document.recompute()
        self.assertIn("Out of date", skin.Status)
        api.compute(skin)
        self.assertFalse(np.array_equal(first, api.result(skin).displacement))
        skin.Seed = 7
        api.compute(skin)
        self.assertTrue(np.array_equal(first, api.result(skin).displacement))

    def test_the_mesh_follows_a_moved_part_and_stays_up_to_date(self):
        skin = self.computed()
        box = skin.Mesh.BoundBox
        self.part.Placement.Base = FreeCAD.Vector(100, 0, 0)
        self.document.recompute()
        self.assertAlmostEqual(skin.Mesh.BoundBox.XMin, box.XMin + 100, places=4)
        self.assertEqual(skin.Status, "Up to date")
        number, value = api.probe(skin, (115, 3, 6))
        self.assertEqual(number, int(self.top[4:]))
        self.assertLess(abs(value), 0.05)

    def test_a_part_in_a_group_is_computed_where_it_stands(self):
        group = self.document.addObject("App::Part", "Group")
        group.addObject(self.part)
        group.Placement.Base = FreeCAD.Vector(100, 0, 0)
        self.document.recompute()
        skin = self.computed()
        self.assertAlmostEqual(skin.Mesh.BoundBox.XMin, 100, delta=0.1)
        self.assertEqual((self.flat.Status, skin.Status), ("OK", "Up to date"))
        self.assertEqual(self.flat.getTypeIdOfProperty("Faces"), "App::PropertyLinkSubGlobal")

    def test_a_changed_part_or_tolerance_is_out_of_date(self):
        skin = self.computed()
        self.flat.Value = 0.02
        self.document.recompute()
        self.assertIn("tolerances or settings", skin.Status)
        self.flat.Value = 0.05
        self.document.recompute()
        self.assertEqual(skin.Status, "Up to date")
        self.part.Base.Width = 22
        self.document.recompute()
        api.accept_faces(skin)
        self.assertIn("Out of date: the part has changed", api.status(skin))

    def test_a_later_check_takes_the_limits_of_now(self):
        skin = self.computed()
        value = api.result(skin).tolerance_rows()[0]["value"]
        before = api.result(skin).displacement
        self.flat.Value = 0.5 * value
        self.document.recompute()
        api.check(skin)
        (row,) = api.result(skin).tolerance_rows()
        self.assertFalse(row["ok"])
        self.assertAlmostEqual(row["value"], value, places=9)
        self.assertTrue(np.array_equal(before, api.result(skin).displacement))

    def test_several_instances(self):
        skin = api.sample(self.skin(), 3)
        found = api.result(skin)
        self.assertEqual(found.size, 3)
        values = found.tolerance_values(self.flat.Name)
        self.assertEqual(len(set(values.tolist())), 3)
        api.show_instance(skin, 2)
        points = np.array([(p.x, p.y, p.z) for p in skin.Mesh.Points])
        np.testing.assert_allclose(points, found.instance_points(2), atol=1e-5)
        with self.assertRaisesRegex(InputError, "no instance 3; it has 3"):
            api.show_instance(skin, 3)
        with self.assertRaisesRegex(InputError, "1 or more"):
            api.sample(skin, 0)

    def test_datums_general_tolerance_and_wishes_reach_the_worker(self):
        api.add_datum(self.part, self.face(self.part, z=0))
        api.add_tolerance(self.part, self.top, "parallelism", 0.08, datums="A", zone_share=0.05)
        api.general_tolerance(self.part, 0.3)
        skin = self.computed()
        rows = api.result(skin).tolerance_rows()
        kinds = {row["characteristic"] for row in rows}
        self.assertEqual(kinds, {"flatness", "parallelism", "surface_profile"})
        self.assertTrue(all(row["ok"] for row in rows), rows)
        self.assertIn("0.004", api.report(skin)["model"])

    def test_export(self):
        skin = self.computed()
        for name in ("Maß.stl", "out.3mf", "out.vtu"):
            self.assertGreater(api.export(skin, self.folder / name).stat().st_size, 1000)
        with self.assertRaisesRegex(InputError, "none of stl"):
            api.export(skin, self.folder / "out.doc")
        with self.assertRaisesRegex(JobError, "(?i)folder|directory"):
            api.export(skin, self.folder / "missing" / "out.stl")
        with self.assertRaisesRegex(InputError, "has not been computed"):
            api.export(self.skin(), self.folder / "out.stl")

    def test_values_without_meaning(self):
        for options, text in (
            ({"instances": 0}, "instances"),
            ({"seed": -1}, "seed"),
            ({"conform": "wish"}, "conform is one of"),
        ):
            with self.assertRaisesRegex(InputError, text):
                self.skin(**options)
        with self.assertRaisesRegex(InputError, "no skin model"):
            api.compute(self.part)

    def test_what_the_worker_refuses_is_told(self):
        skin = self.skin()
        self.flat.Modifiers = ["nonsense"]
        with self.assertRaisesRegex(JobError, "nonsense"):
            api.compute(skin)
        self.assertIn("Failed", skin.Status)
        self.assertEqual(self.document.HasPendingTransaction, False)

    def test_this_process_stays_a_thin_client(self):
        self.computed()
        heavy = {"cadskin", "OCP", "cadquery", "numba", "gmsh", "scipy"} & set(sys.modules)
        self.assertEqual(heavy, set())


class Documents(SkinTest):
    def test_undo_and_redo_of_a_result(self):
        skin = self.computed()
        first = api.result(skin).displacement
        self.assertEqual(self.document.UndoNames[0], "Skin model result")
        self.document.undo()
        self.assertEqual((skin.Mesh.CountPoints, api.result(skin)), (0, None))
        self.document.redo()
        self.assertTrue(np.array_equal(first, api.result(skin).displacement))
        self.assertGreater(skin.Mesh.CountPoints, 100)

    def test_save_and_reopen_keeps_all(self):
        skin = api.sample(self.skin(), 2)
        api.show_instance(skin, 1)
        before, rows, name = api.result(skin), api.result(skin).tolerance_rows(1), skin.Name
        mesh = skin.Mesh.CountPoints
        document = self.reopened("Größe.FCStd")
        skin = document.getObject(name)
        after = api.result(skin)
        for key in ("points", "triangles", "triangle_face", "displacement", "corner_deviation"):
            np.testing.assert_array_equal(getattr(before, key), getattr(after, key))
        self.assertEqual(after.tolerance_rows(1), rows)
        self.assertEqual((skin.Mesh.CountPoints, skin.Instance), (mesh, 1))
        self.assertEqual(api.status(skin), "Up to date")
        document.recompute(None, True)
        self.assertEqual(skin.Status, "Up to date")
        tolerance = api.tolerances(skin.Part)[0]
        self.assertEqual((tolerance.Status, tolerance.Value.Value), ("OK", 0.05))
        api.compute(skin)

    def test_a_damaged_result_is_told(self):
        from freecad.CadSkin.result import ResultError

        skin = self.computed()
        with open(skin.ResultFile, "wb") as stream:
            stream.write(b"no archive")
        with self.assertRaisesRegex(ResultError, "skin"):
            api.result(skin)

    def test_undo_while_a_job_runs(self):
        skin = self.skin()
        name = skin.Name
        api.compute(skin, wait=False)
        job = jobs.job_of(skin)
        self.document.undo()  # takes the skin model away
        self.assertIsNone(self.document.getObject(name))
        job.wait(LIMIT)
        self.assertTrue(job.finished)
        self.document.redo()
        again = self.document.getObject(name)
        self.assertIsNotNone(again)
        self.assertIsNone(jobs.job_of(again))
        self.assertIn(api.status(again), ("Not computed", "Up to date"))

    def test_a_document_that_is_closed_during_a_job(self):
        skin = self.skin()
        api.compute(skin, wait=False)
        job = jobs.job_of(skin)
        FreeCAD.closeDocument(self.document.Name)
        job.wait(LIMIT)
        self.assertEqual(job.state, "cancelled")
        self.assertFalse(job.folder.exists())

    def test_a_skin_model_that_is_deleted_during_a_job(self):
        skin = self.skin()
        api.compute(skin, wait=False)
        job = jobs.job_of(skin)
        self.document.removeObject(skin.Name)
        job.wait(LIMIT)
        self.assertEqual(job.state, "cancelled")

    def test_a_document_that_was_saved_during_a_job(self):
        skin = self.skin()
        api.compute(skin, wait=False)
        self.assertIn("Computing", skin.Status)
        name = skin.Name
        skin = self.reopened().getObject(name)
        self.assertEqual(skin.Status, "Not computed")

    def test_a_full_disk_when_the_result_arrives(self):
        skin = self.computed()
        before = api.result(skin).displacement
        skin.Seed = 8
        full = mock.patch(
            "freecad.CadSkin.skin.write_ply", side_effect=OSError(28, "No space left on device")
        )
        with full, self.assertRaisesRegex(JobError, "No space left"):
            api.compute(skin)
        self.assertIn("No space left", skin.Status)
        self.assertFalse(self.document.HasPendingTransaction)
        self.assertTrue(np.array_equal(before, api.result(skin).displacement))
        self.assertGreater(skin.Mesh.CountPoints, 100)

    def test_job_folders_with_any_name(self):
        place = self.folder / "Aufträge für Ø"
        place.mkdir()
        with mock.patch("tempfile.tempdir", str(place)):
            skin = self.computed()
        self.assertEqual(skin.Status, "Up to date")
        self.assertEqual(list(place.iterdir()), [])  # and nothing is left behind

    def test_two_jobs_at_once(self):
        first, second = self.skin(), self.skin(seed=9)
        api.compute(first, wait=False)
        api.compute(second, wait=False)
        with self.assertRaisesRegex(InputError, "is being computed"):
            api.compute(first)
        self.assertIn("Computing", first.Status)
        for skin in (second, first):
            job = jobs.job_of(skin)
            if job is not None:
                job.wait(LIMIT)
        self.assertEqual((first.Status, second.Status), ("Up to date", "Up to date"))
        self.assertFalse(np.array_equal(api.result(first).displacement, api.result(second).displacement))

    def test_cancel_leaves_the_old_result(self):
        skin = self.computed()
        before = api.result(skin).displacement
        skin.Instances = 100_000
        api.compute(skin, wait=False)
        job = jobs.job_of(skin)
        while job.text != "drawing parts" and not job.finished:
            engine.engine().pump(0.05)
        self.assertTrue(api.cancel(skin))
        job.wait(30)
        self.assertEqual(job.state, "cancelled")
        self.assertEqual(skin.Status, "Cancelled")
        self.assertTrue(np.array_equal(before, api.result(skin).displacement))
        self.assertFalse(api.cancel(skin))
        skin.Instances = 1
        api.compute(skin)
        self.assertEqual(skin.Status, "Up to date")

    def test_a_macro_that_holds_a_transaction_keeps_it(self):
        skin = self.skin()
        self.document.openTransaction("Mine")
        api.compute(skin, wait=True)
        self.assertTrue(self.document.HasPendingTransaction)
        self.document.abortTransaction()
        self.assertIsNone(api.result(skin))

    def test_a_document_of_an_older_version_gets_what_it_lacks(self):
        skin = self.skin()
        skin.removeProperty("CorrelationLength")
        name = skin.Name
        skin = self.reopened().getObject(name)
        self.assertIn("CorrelationLength", skin.PropertiesList)

    def test_a_part_of_500_faces(self):
        import time

        import Part

        tools = [
            Part.makeCylinder(0.4, 10, FreeCAD.Vector(1 + 1.5 * i, 1 + 1.5 * k, -1))
            for i in range(26)
            for k in range(19)
        ]
        shape = Part.makeBox(42, 30, 3).cut(Part.makeCompound(tools))
        part = self.document.addObject("Part::Feature", "Sieve")
        part.Shape = shape
        self.document.recompute()
        self.assertEqual(len(part.Shape.Faces), 500)
        bores = [
            f"Face{k}" for k, face in enumerate(shape.Faces, 1) if type(face.Surface).__name__ == "Cylinder"
        ]
        started = time.process_time()
        made = api.add_tolerance(part, bores, "cylindricity", 0.02)
        skin = api.create_skin(part, edge_length=1.5)
        self.document.recompute(None, True)
        self.assertLess(time.process_time() - started, 5.0)
        self.assertEqual((made.Status, skin.Status), ("OK", "Not computed"))


SHAPE = "cq.Workplane().box(30, 20, 6)"
SPEC = "cs.Specification(cs.flatness('>Z', 0.02), cs.parallelism('>Z', 0.05, datums='A'), datums={'A': '<Z'})"


class Importing(DocumentTest):
    def test_tolerances_of_a_step_file_come_with_their_faces(self):
        path = self.folder / "Stück.step"
        self.write_step(path)
        (part,) = api.import_step(path, self.document)
        made = {obj.Label: obj for obj in api.tolerances(part)}
        self.assertEqual(len(made), 3, list(made))
        self.assertEqual({obj.Status for obj in made.values()}, {"OK"})
        for obj in made.values():
            (name,) = obj.Faces[1]
            height = part.Shape.getElement(name).CenterOfMass.z
            self.assertAlmostEqual(height, -3.0 if hasattr(obj, "Letter") else 3.0)
        values = sorted(obj.Value.Value for obj in made.values() if hasattr(obj, "Value"))
        self.assertEqual(values, [0.02, 0.05])
        self.assertEqual(self.document.UndoNames[0], "Import STEP with tolerances")
        skin = api.compute(api.create_skin(part, edge_length=3.0))
        self.assertTrue(api.report(skin)["instances"][0]["conforming"])

    def test_sizes_come_too_and_serve_material_requirements(self):
        path = self.folder / "bore.step"
        self.write_step(
            path,
            "cq.Workplane().box(30, 20, 6).faces('>Z').workplane().hole(8)",
            "cs.Specification("
            "cs.perpendicularity('%CYLINDER', 0.05, datums='A', diameter=True, material='MMR'), "
            "datums={'A': '<Z'}, dimensions=[cs.size('%CYLINDER', 8.0, fit='H9')])",
        )
        (part,) = api.import_step(path, self.document)
        (size,) = (obj for obj in api.tolerances(part) if obj.Proxy.Type == "CadSkinDimension")
        self.assertEqual((size.Text[:6], size.Status), ("size 8", "OK"))
        skin = api.compute(api.create_skin(part, edge_length=2.0))
        rows = {row["id"]: row for row in api.result(skin).tolerance_rows()}
        self.assertEqual(len(rows), 2, rows)
        self.assertTrue(all(row["ok"] for row in rows.values()), rows)
        self.assertAlmostEqual(rows[size.Name]["value"], 8.0, delta=0.05)
        self.assertIn("limits of size 8 mm to 8.036 mm", rows[size.Name]["reason"])

    def write_step(self, path, shape=SHAPE, spec=SPEC):
        """Write a STEP file with tolerances, in the worker's Python."""
        import subprocess

        from freecad.CadSkin.protocol import clean_environment

        from .support import python_for_scripts

        code = f"import sys, cadquery as cq, cadskin as cs\ncs.write_step(sys.argv[1], {shape}, {spec})\n"
        subprocess.run(
            [python_for_scripts(), "-c", code, str(path)],
            check=True,
            env=clean_environment(),
            cwd=str(self.folder),
        )

    def test_a_file_that_is_not_there_or_no_step(self):
        with self.assertRaisesRegex(InputError, "no such file"):
            api.import_step(self.folder / "none.step", self.document)
        (self.folder / "text.step").write_text("hello")
        with self.assertRaisesRegex(JobError, "text.step"):
            api.import_step(self.folder / "text.step", self.document)
        self.assertEqual(self.document.Objects, [])
