"""What jobs do, in this process."""

import json

import numpy as np
import pytest

FLAT = {"id": "T1", "characteristic": "flatness", "value": 0.05, "faces": [3]}


def test_simulate_leaves_arrays_that_fit_together(jobs):
    done = jobs.run(tolerances=[FLAT], size=2, seed=7)
    assert done["event"] == "done", done
    fractions = [message["fraction"] for message in jobs.messages[:-1]]
    assert fractions == sorted(fractions)
    assert all(message["job"] == "j" for message in jobs.messages)
    with np.load(jobs.folder / "skin.npz") as file:
        arrays = dict(file)
    n, m = len(arrays["points"]), len(arrays["triangles"])
    assert arrays["displacement"].shape == (2, n, 3)
    assert arrays["corner_deviation"].shape == (2, m, 3)
    assert set(np.unique(arrays["triangle_face"])) == set(range(1, 8))
    top = arrays["triangle_face"] == 3
    assert np.allclose(arrays["points"][arrays["triangles"][top], 2], 3.0)  # Face3 is the upper side
    # On the plane the deviation is the displacement along z, at every corner, on edges too.
    moved = arrays["displacement"][0][arrays["triangles"][top], 2]
    assert np.allclose(moved, arrays["corner_deviation"][0][top], atol=1e-6)


def test_the_report_has_the_extent_and_a_row_per_tolerance(jobs):
    jobs.run(tolerances=[FLAT, {**FLAT, "id": "T0", "faces": [5]}], size=1, seed=1)
    (report,) = jobs.result()["instances"]
    with np.load(jobs.folder / "skin.npz") as file:
        corners = file["corner_deviation"][0]
    assert report["min"] == pytest.approx(corners.min(), abs=1e-7)
    assert report["max"] == pytest.approx(corners.max(), abs=1e-7)
    assert [row["id"] for row in report["tolerances"]] == ["T1", "T0"]
    assert all(row["ok"] and 0 < row["value"] <= 0.05 and row["certified"] for row in report["tolerances"])
    assert report["conforming"] is True


def test_a_seed_gives_the_same_part_and_another_seed_another(jobs):
    found = []
    for seed in (3, 3, 4):
        jobs.run(tolerances=[FLAT], seed=seed)
        with np.load(jobs.folder / "skin.npz") as file:
            found.append(file["displacement"])
    assert np.array_equal(found[0], found[1])
    assert not np.array_equal(found[0], found[2])


def test_a_target_is_met(jobs):
    jobs.run(tolerances=[FLAT], conform={"T1": 0.02})
    (row,) = jobs.result()["instances"][0]["tolerances"]
    assert row["value"] == pytest.approx(0.02, abs=1e-6)


def test_a_wish_for_larger_deviations_is_heard(jobs):
    spread = []
    for share in (0.02, 0.2):
        wish = {"share": share, "length": 6.0}
        jobs.run(tolerances=[{**FLAT, "deviation": wish}], conform="none", seed=5)
        with np.load(jobs.folder / "skin.npz") as file:
            spread.append(file["corner_deviation"][0][file["triangle_face"] == 3].std())
    assert spread[1] == pytest.approx(10 * spread[0], rel=0.05)


def test_without_tolerances_the_general_one_by_size_is_taken_and_said(jobs):
    done = jobs.run(edge_length=6.0)
    assert "profile of 0.1 mm" in done["warnings"][0]
    assert len(jobs.result()["instances"][0]["tolerances"]) == 7


def test_what_cannot_be_evaluated_is_a_row_with_a_reason(jobs):
    odd = {**FLAT, "id": "odd", "extra": {"maximum": 1.0}}
    jobs.run(tolerances=[FLAT, odd])
    report = jobs.result()["instances"][0]
    assert [row["ok"] for row in report["tolerances"]] == [True, None]
    assert "not supported" in report["tolerances"][1]["reason"]
    assert report["conforming"] is False


def test_verify_takes_other_limits_and_export_writes_the_same_mesh(jobs):
    jobs.run(tolerances=[FLAT], seed=2)
    value = jobs.result()["instances"][0]["tolerances"][0]["value"]
    assert jobs.run("verify", tolerances=[{**FLAT, "value": 0.9 * value}])["event"] == "done"
    (row,) = jobs.result()["instances"][0]["tolerances"]
    assert row["value"] == pytest.approx(value, rel=1e-9)
    assert row["ok"] is False
    target = jobs.folder / "Größe.3mf"
    assert jobs.run("export", path=str(target))["event"] == "done"
    assert target.stat().st_size == jobs.result()["bytes"] > 1000


def test_what_was_computed_with_another_mesh_is_not_verified(jobs):
    jobs.run(tolerances=[FLAT])
    message = jobs.run("verify", tolerances=[FLAT], edge_length=5.0)
    assert "compute it again" in message["text"]


def test_step_with_pmi_becomes_brep_and_tables(jobs):
    cq = pytest.importorskip("cadquery")
    import cadskin as cs

    file = jobs.folder / "Blöcke.step"
    part = cq.Workplane().box(30, 20, 6)
    spec = cs.Specification(
        cs.flatness(">Z", 0.02), cs.parallelism(">Z", 0.05, datums="A"), datums={"A": "<Z"}
    )
    cs.write_step(file, part, spec)
    assert jobs.run("import_step", path=str(file))["event"] == "done"
    (record,) = jobs.result()["parts"]
    nominal = cs.nominal(jobs.folder / record["brep"], edge_length=5.0)
    (top,), (below,) = ([t["faces"][0]] for t in (record["tolerances"][0], record["datums"][0]))
    assert np.allclose(nominal.faces[top - 1].centre, (0, 0, 3))
    assert np.allclose(nominal.faces[below - 1].centre, (0, 0, -3))
    assert [t["value"] for t in record["tolerances"]] == [0.02, 0.05]
    assert record["tolerances"][1]["datums"] == "A"
    # Simulate what was imported.
    (jobs.folder / "part.brep").write_bytes((jobs.folder / record["brep"]).read_bytes())
    jobs.run(tolerances=record["tolerances"], datums=record["datums"])
    assert jobs.result()["instances"][0]["conforming"]


def test_versions_loads_the_kernel(jobs):
    assert jobs.run("versions")["event"] == "done"
    assert {"cadskin", "python", "numpy"} <= set(jobs.result()["versions"])


def test_the_faces_of_the_client_are_compared(jobs):
    same = {"3": {"area": 600 - np.pi * 16, "centre": [0, 0, 3]}}
    assert jobs.run(tolerances=[FLAT], faces=same, n_faces=7)["event"] == "done"


def test_verify_needs_a_tolerance(jobs):
    jobs.run(tolerances=[FLAT])
    assert "no tolerance" in jobs.run("verify")["text"]


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"protocol": 99}, "RequestError", "protocol 99, this worker"),
        ({"task": "dance"}, "RequestError", "simulate, verify"),
        ({"edge_length": -1}, "RequestError", "edge_length must be a positive number"),
        ({"size": 0}, "RequestError", "size must be a whole number from 1"),
        ({"seed": -1}, "RequestError", "seed"),
        ({"tolerances": "flatness"}, "RequestError", "list of tables"),
        ({"tolerances": [{**FLAT, "faces": [8]}]}, "SpecificationError", "T1"),
        ({"tolerances": [{**FLAT, "characteristic": "cylindricity"}]}, "SpecificationError", "cylindricity"),
        ({"faces": {"6": {"area": 120.0, "centre": [0, 0, 3]}}}, "GeometryError", "Face6 is another face"),
        ({"faces": {"9": {"area": 1.0, "centre": [0, 0, 3]}}}, "GeometryError", "Face9 is not there"),
        ({"n_faces": 8}, "GeometryError", "7 faces for the worker and 8 in FreeCAD"),
        ({"conform": "wish"}, "SpecificationError", "wish"),
        ({"conform": {"T7": 0.1}, "tolerances": [FLAT]}, "SpecificationError", "T7"),
        ({"tolerances": [{**FLAT, "deviation": {"share": -1}}]}, "RequestError", "share"),
        ({"tolerances": [{**FLAT, "deviation": {"text": "fild"}}]}, "DeviationError", "fild"),
        ({"task": "verify"}, "RequestError", "skin.npz"),
        ({"task": "verify", "tolerances": [FLAT]}, "RequestError", "skin.npz"),
        ({"task": "import_step"}, "RequestError", "path"),
        ({"task": "import_step", "path": "none.step"}, "ReadError", "no such file"),
    ],
)
def test_a_wrong_request_ends_with_a_message(jobs, options, error, text):
    message = jobs.run(**options)
    assert message["event"] == "error"
    assert message["error"] == error
    assert text in message["text"]


def test_a_cancelled_job_says_so(jobs):
    message = jobs.run(cancel=True)
    assert (message["event"], message["error"]) == ("error", "Cancelled")


def test_two_solids_are_refused(jobs):
    cq = pytest.importorskip("cadquery")
    two = cq.Workplane().pushPoints([(0, 0), (9, 0)]).box(2, 2, 2, combine=False)
    cq.Compound.makeCompound(two.vals()).exportBrep(str(jobs.folder / "part.brep"))
    assert "2 solids" in jobs.run(edge_length=1.0)["text"]


def test_a_damaged_part_is_named(jobs):
    (jobs.folder / "part.brep").write_text("DBRep_DrawableShape\n")
    message = jobs.run()
    assert (message["event"], message["error"]) == ("error", "ReadError")


def test_a_full_disk_is_reported(jobs, monkeypatch):
    def full(*_args, **_options):
        raise OSError(28, "No space left on device", "skin.npz")

    monkeypatch.setattr("cadskin.worker.results.np.savez", full)
    message = jobs.run(tolerances=[FLAT])
    assert "No space left on device" in message["text"]
    assert "skin.npz" in message["text"]


def test_a_defect_does_not_end_the_worker(jobs, monkeypatch):
    monkeypatch.setattr("cadskin.worker.tasks.write_skin", lambda *_: 1 / 0)
    message = jobs.run(tolerances=[FLAT])
    assert message["error"] == "InternalError"
    assert "ZeroDivisionError" in message["trace"]


def test_a_request_that_is_no_table(jobs, memory):
    import io

    from cadskin.worker.channel import Channel
    from cadskin.worker.serve import Client, run_job

    for text in ("{", "[]"):
        (jobs.folder / "request.json").write_text(text)
        stream = io.StringIO()
        assert not run_job(jobs.folder, Channel(stream), Client(), memory, "x")
        message = json.loads(stream.getvalue())
        assert (message["job"], message["error"]) == ("x", "RequestError")
