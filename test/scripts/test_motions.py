"""A run as it is looked at (view.py, gltf.py), on files written by hand: its moments, contacts, curves and surfaces."""
import base64
import io
import json
import struct
import unittest
from unittest import mock

import numpy as np
import pandas as pd
from contactbench import gltf, program, view
from folder import Folder
from made import csv_of, trajectory

SHAPES = "shape,body,kind,px,py,pz,qw,qx,qy,qz,radius,hx,hy,hz"
CONTACTS = "t,step,a,b,px,py,pz,nx,ny,nz,ux,uy,uz,rx,ry,rz,mode"
SUMMARY = {
    "scenario": "pair", "title": "Two of them", "method": "ap", "solver": "lemke", "variant": None, "status": "ray",
    "parameters": {"boxes": 16, "mu": 0.25, "start": "steady"}, "options": {"step": 0.1, "k": 8, "epsilon": None}}
QUARTER = (np.sqrt(0.5), 0, 0, np.sqrt(0.5))  # about z, w first
OTHER = (0.1, 0.7, 0.5, 0.5)  # of length 1, each part another


def shape(name, body, kind, place=(0, 0, 0), turn=(1, 0, 0, 0), radius=0, half=(0, 0, 0)):
    return name, body, kind, *place, *turn, radius, *half


def place(body, moment):
    return (moment, 2 * moment, -3 * moment) if body == "one" else (10 + moment, 20, 30)


class Made(Folder):
    def run_of(self, name="run", moments=6, summary=(), shift=0.0, contacts=(), steps=()):
        """Two bodies that move, a moment every 0.1 s; `shift`: of the second, along z."""
        folder = self.top / name
        folder.mkdir()
        (folder / "summary.json").write_text(json.dumps(SUMMARY | dict(summary)))
        rows = [(round(0.1 * n, 9), body, np.add(place(body, n), (0, 0, shift * n * (body == "two"))), turn)
                for n in range(moments) for body, turn in (("one", OTHER), ("two", QUARTER))]
        (folder / "trajectory.csv").write_text(trajectory(rows))
        (folder / "shapes.csv").write_text(
            csv_of(SHAPES, [
                shape("ground", "", "half_space", (0, -1, 0)),
                shape("s_one", "one", "box", (0.1, 0.2, 0.3), OTHER, half=(1, 2, 3)),
                shape("s_two", "two", "hull"),
                shape("rest", "", "sphere", (7, 8, 9), radius=0.5)]))
        square, triangle = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 0, 0), (0, 0, 1), (0, 1, 0)]
        (folder / "hulls.csv").write_text(
            csv_of("shape,face,x,y,z", [("s_two", n, *p) for n, face in enumerate((square, triangle)) for p in face]))
        steps = steps or [(n, round(0.1 * n, 9), 10.0 * n, -n, 1000 - n, 1e-3 * n) for n in range(1, moments)]
        (folder / "steps.csv").write_text(csv_of("step,t,residual,event_energy_gain,kinetic_energy,max_penetration", steps))
        (folder / "contacts.csv").write_text(csv_of(CONTACTS, contacts))
        return folder


def contact(step, a, b, at, impulse, mode):
    return 99, step, a, b, *at, 0, 1, 0, 0, 0, 0, *impulse, mode


class Motion(Made):
    def test_moments_are_spread_over_the_run_and_quaternions_end_with_w(self):
        motion = view.Motion(self.run_of(), frames=3)
        self.assertEqual(motion.bodies, ["one", "two"])
        np.testing.assert_allclose(motion.t, [0, 0.2, 0.5])
        for frame, n in zip(motion.poses, (0, 2, 5)):
            np.testing.assert_allclose(frame,
                                       [[*place("one", n), *OTHER[1:], OTHER[0]], [*place("two", n), *QUARTER[1:], QUARTER[0]]])
        self.assertEqual({key: tuple(p) for key, p in motion.places().items()},
                         {(0.1 * n if n != 2 else 0.2, body): place(body, n) for n in (0, 2, 5) for body in ("one", "two")})
        self.assertEqual(len(view.Motion(self.top / "run").t), 6)

    def test_what_a_killed_run_left_half_is_not_drawn(self):
        folder = self.run_of()
        with open(folder / "trajectory.csv", "a") as file:
            file.write("0.6,one,1,2,3,1,0,0,0,0,0,0,0,0,0\n0.6,two,1,2")
        motion = view.Motion(folder)
        self.assertEqual((len(motion.poses), motion.t[-1]), (6, 0.5))
        (folder / "some.csv").write_text("a,b\n1,\n2,5\n3,\n")
        self.assertEqual(list(view.table(folder / "some.csv")["a"]), [1, 2])  # only the last row can be half
        (folder / "empty.csv").write_text("")
        self.assertTrue(view.table(folder / "empty.csv").empty and view.table(folder / "none.csv").empty)

    def test_without_shapes_there_is_no_motion(self):
        folder = self.run_of()
        (folder / "shapes.csv").write_text(SHAPES + "\n")
        with self.assertRaisesRegex(program.ProgramError, "--record-contacts --out .*run makes it"):
            view.Motion(folder)

    def test_a_run_is_called_by_its_method_and_knobs_and_its_scene_by_its_parameters(self):
        motion = view.Motion(self.run_of())
        self.assertEqual((motion.name, motion.label, motion.scene),
                         ("ap lemke k 8", "ap lemke k 8", "pair boxes=16 mu=0.25 start=steady"))
        other = {
            "method": "newton", "solver": None, "variant": "uncapped", "options": {"k": None, "epsilon": 1e-12},
            "parameters": None}
        motion = view.Motion(self.run_of("other", summary=other), "mine")
        self.assertEqual((motion.name, motion.label, motion.scene), ("newton uncapped epsilon 1e-12", "mine", "pair"))

    def test_contacts_are_shown_at_the_end_of_their_step(self):
        some = [
            contact(2, "s_one", "ground", (1, 0, 2), (0, 3, 0), "stick"),
            contact(1, "s_one", "ground", (9, 9, 9), (0, 9, 0), "slip"),
            contact(5, "s_two", "ground", (4, 5, 6), (1, 2, 2), "open")]
        motion = view.Motion(self.run_of(contacts=some), frames=3)  # 0, 0.2 and 0.5 s
        self.assertEqual([0 if c is None else len(c) for c in motion.contacts], [0, 1, 1])
        self.assertEqual(motion.contacts[1][["px", "py", "pz", "rx", "ry", "rz"]].values.tolist(), [[1, 0, 2, 0, 3, 0]])

    def test_events_of_a_step_add_up_at_a_point_and_have_the_mode_of_the_largest(self):
        rows = [
            contact(2, "a", "ground", (1, 0, 0), (0, 1, 0), "open"),
            contact(2, "a", "ground", (1.0004, 0, 0), (3, 4, 0), "slip"),
            contact(2, "a", "ground", (1, 0, 0), (0, 2, 2), "stick"),
            contact(2, "a", "ground", (1.01, 0, 0), (0, 8, 0), "open"),
            contact(2, "b", "ground", (1, 0, 0), (0, 16, 0), "stick"),
            contact(3, "a", "ground", (1, 0, 0), (0, 32, 0), "stick")]
        table = pd.DataFrame(rows, columns=CONTACTS.split(","))
        found = view.merged(table.assign(end=table["step"] / 10), ["ground"])
        self.assertEqual(sorted(found[0.2][["rx", "ry", "rz", "mode"]].values.tolist()),
                         sorted([[3, 7, 2, "slip"], [0, 8, 0, "open"], [0, 16, 0, "stick"]]))
        self.assertEqual(found[0.3][["rx", "ry", "rz", "mode"]].values.tolist(), [[0, 32, 0, "stick"]])

    def test_points_of_what_is_small_are_told_apart(self):
        # The corners of a box of a millimetre; what the events of a step have at one of them is one.
        corners = [contact(2, "s_one", "ground", (x, 0, z), (0, 1, 0), "stick") for x in (-5e-4, 5e-4) for z in (-5e-4, 5e-4)]
        again = contact(2, "s_one", "ground", (5e-4 + 1e-6, 0, 5e-4), (0, 2, 0), "slip")
        folder = self.run_of(contacts=[*corners, again])
        (folder / "shapes.csv").write_text(
            csv_of(SHAPES, [shape("ground", "", "half_space"), shape("s_one", "one", "box", half=(5e-4, 5e-4, 5e-4))]))
        found = view.Motion(folder).contacts[2]
        self.assertEqual(sorted(found["ry"]), [1, 1, 1, 3])
        for half, digits in ((5e-4, 5), (4e-4, 5), (5e-3, 4), (0.5, 3), (0, 3)):
            some = pd.DataFrame([shape("s", "one", "box", half=(half / 2, half, 0))], columns=SHAPES.split(","))
            self.assertEqual(view.decimals(some), digits, half)

    def test_of_two_that_move_impulses_add_up_before_it_is_said_on_which_they_are_drawn(self):
        up, down = (5, 1e-17, 0), (5, -1e-17, 0)
        rows = [contact(2, "a", "b", (1, 0, 0), up, "stick"), contact(2, "a", "b", (1, 0, 0), down, "stick"),
                contact(3, "a", "b", (1, 0, 0), (0, 3, 0), "stick"), contact(3, "a", "b", (1, 0, 0), (1, -1, 0), "slip"),
                contact(4, "a", "b", (1, 0, 0), (1, 3, 0), "stick"), contact(4, "a", "b", (1, 0, 0), (1, -4, 0), "slip"),
                contact(5, "ground", "b", (1, 0, 0), (0, -3, 0), "stick"), contact(5, "ground", "b", (1, 0, 0), (1, 1, 0), "slip")]
        table = pd.DataFrame(rows, columns=CONTACTS.split(","))
        found = view.merged(table.assign(end=table["step"]), ["ground"])
        self.assertEqual({end: of[["rx", "ry", "rz"]].values.tolist() for end, of in found.items()},
                         {2: [[10, 0, 0]], 3: [[1, 2, 0]], 4: [[-2, 1, 0]], 5: [[-1, 2, 0]]})

    def test_hulls_have_the_corners_of_their_faces(self):
        ground, one, two, rest = view.Motion(self.run_of()).surfaces()
        self.assertEqual(two["faces"], [[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]]])
        self.assertEqual(
            [[s["shape"], s["body"], s["kind"]] for s in (ground, one, two, rest)],
            [["ground", "", "half_space"], ["s_one", "one", "box"], ["s_two", "two", "hull"], ["rest", "", "sphere"]])
        self.assertEqual((one["hx"], one["hy"], one["hz"], one["px"], rest["radius"]), (1, 2, 3, 0.1, 0.5))
        self.assertNotIn("faces", one)

    def test_curves_are_the_columns_of_their_steps(self):
        found = view.Motion(self.run_of()).curves()
        self.assertEqual({key: one["v"] for key, one in found.items()}, {
            "residual": [10, 20, 30, 40, 50], "event_energy_gain": [-1, -2, -3, -4, -5], "kinetic_energy": [
                999, 998, 997, 996, 995], "max_penetration": [1e-3, 2e-3, 3e-3, 4e-3, 5e-3]})
        self.assertEqual({tuple(one["t"]) for one in found.values()}, {(0.1, 0.2, 0.3, 0.4, 0.5)})
        self.assertEqual({key: said for key, said in view.CURVES.items()}, {
            "residual": ("checked residual", "", True), "event_energy_gain": ("energy gain of the events", "J", False),
            "kinetic_energy": ("kinetic energy", "J", False), "max_penetration": ("overlap", "m", True)})
        long = [(n, n, n, n, n, n) for n in range(1, 1202)]
        found = view.Motion(self.run_of("long", steps=long)).curves()["residual"]
        self.assertEqual((len(found["t"]), found["v"][0], found["v"][-1]), (view.FRAMES, 1, 1201))

    def test_numbers_of_the_page_are_short_and_what_is_none_is_null(self):
        self.assertEqual(view.numbers_of([1.23456789, np.nan, np.inf, 1e-9]), [1.23457, None, None, 1e-9])
        self.assertEqual(view.curve([0.1234567], pd.Series(["0.98765"])), {"t": [0.123457], "v": [0.9877]})
        self.assertEqual(view.curve([1], pd.Series(["what"])), {"t": [1], "v": [None]})

    def test_of_all_bodies_the_farthest_says_how_far_apart_two_motions_are(self):
        at = {(t, body): (0, 0, z) for t, some in ((1.0, (0.25, 0.5)), (2.0, (0.75, 0.125)), (3.0, (9, 9)))
              for body, z in zip("ab", some)}
        zero = {(t, body): (0, 0, 0) for t in (0.0, 1.0, 2.0) for body in "abc"}
        self.assertEqual(view.apart(at, zero), {"t": [1, 2], "v": [0.5, 0.75]})  # at the moments that both have

    def test_the_long_arrow_is_nearly_the_largest_impulse(self):
        vectors = np.outer(np.arange(101), [0.6, 0, 0.8])
        self.assertAlmostEqual(view.largest(vectors), 98)
        self.assertEqual((view.largest(np.zeros((0, 3))), view.largest(np.zeros((3, 3)))), (1.0, 1.0))


def unpacked(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


class Page(Made):
    def test_the_page_has_poses_contacts_and_modes_as_they_are(self):
        some = [
            contact(5, "s_two", "ground", (4, 5, 6), (3, 4, 0), "open"),
            contact(2, "s_one", "ground", (1, 0, 2), (0, 3, 0), "slip"),
            contact(2, "s_two", "ground", (7, 8, 9), (0, 1, 0), "stick")]
        made = view.Motion(self.run_of(contacts=some), frames=3).page()
        self.assertEqual((made["label"], made["status"], made["bodies"], made["t"]),
                         ("ap lemke k 8", "ray", ["one", "two"], [0, 0.2, 0.5]))
        np.testing.assert_allclose(
            unpacked(made["poses"], "<f4").reshape(3, 2, 7)[2, 0], [5, 10, -15, *OTHER[1:], OTHER[0]], rtol=1e-6)
        self.assertEqual(made["contacts"]["count"], [0, 2, 1])
        np.testing.assert_allclose(sorted(unpacked(made["contacts"]["numbers"], "<f4").reshape(-1, 6).tolist()),
                                   [[1, 0, 2, 0, 3, 0], [4, 5, 6, 3, 4, 0], [7, 8, 9, 0, 1, 0]])
        self.assertEqual(list(unpacked(made["contacts"]["modes"], "u1"))[-1], 0)
        self.assertEqual(sorted(unpacked(made["contacts"]["modes"], "u1")), [0, 1, 2])
        self.assertEqual(view.MODES, ("open", "stick", "slip"))
        self.assertAlmostEqual(made["impulse"], float(np.quantile([1, 3, 5], 0.98)))

    def test_two_runs_are_compared_with_each_other_and_any_with_a_reference(self):
        a, b = self.run_of("a"), self.run_of("b", shift=0.5)
        alone = view.scene_of([a])
        self.assertEqual((alone["name"], alone["title"], list(alone["curves"])),
                         ("pair boxes=16 mu=0.25 start=steady", "Two of them", list(view.CURVES)))
        two = view.scene_of([a, b], labels=["first"])
        self.assertEqual([run["label"] for run in two["runs"]], ["first", "ap lemke k 8"])
        self.assertEqual(two["curves"]["error"], ["distance between the two", "m", True])
        self.assertEqual(two["runs"][0]["curves"]["error"], {"t": [0, 0.1, 0.2, 0.3, 0.4, 0.5], "v": [0, 0.5, 1, 1.5, 2, 2.5]})
        self.assertNotIn("error", two["runs"][1]["curves"])
        stored = self.top / "stored.csv"
        stored.write_text("t,body,px,py,pz\n" + "".join(f"{0.1 * n},two,{10 + n},20,{30 + 0.2 * n}\n" for n in (0, 2, 4)))
        for reference, first, second in ((stored, [0, 0.4, 0.8], [0, 0.6, 1.2]), (a, 6 * [0], [0, 0.5, 1, 1.5, 2, 2.5])):
            made = view.scene_of([a, b], reference)
            self.assertEqual(made["curves"]["error"], ["distance from the reference", "m", True])
            for run, values in zip(made["runs"], (first, second)):
                np.testing.assert_allclose(run["curves"]["error"]["v"], values, atol=1e-9)
        self.assertEqual(made["runs"][0]["curves"]["error"]["t"][-1], 0.5)

    def test_what_would_need_more_room_has_fewer_moments(self):
        folder = self.run_of(moments=200)
        # Seven numbers of four bytes a body, a third more as letters, and 80 a moment.
        of_one = 4 / 3 * 7 * 4 * 2 + 80
        self.assertAlmostEqual(view.Motion(folder).bytes_of_a_frame(), of_one)
        self.assertEqual(len(view.scene_of([folder], room=200 * of_one)["runs"][0]["t"]), 200)
        fewer = len(view.scene_of([folder], room=60 * of_one)["runs"][0]["t"])
        self.assertLessEqual(fewer, 60)
        self.assertGreater(fewer, 40)
        self.assertEqual(len(view.scene_of([folder], room=1)["runs"][0]["t"]), view.FEWEST)
        # Of two runs both take room.
        two = view.scene_of([folder, self.run_of("other", moments=200)], room=200 * of_one)["runs"]
        self.assertTrue(all(90 < len(run["t"]) <= 100 for run in two))
        held = self.run_of(
            "held", moments=3, contacts=[
                contact(n, "s_two", "ground", (n, k, 0), (0, 1, 0), "open") for n in (1, 2) for k in (1, 2, 3)])
        self.assertAlmostEqual(view.Motion(held).bytes_of_a_frame(), of_one + 4 / 3 * 25 * 6 / 3)  # six numbers and a mode each

    def test_the_page_needs_nothing_else_and_holds_its_scenes(self):
        for name in view.SCRIPTS:
            (self.top / "three" / name).parent.mkdir(parents=True, exist_ok=True)
            (self.top / "three" / name).write_text(f'"{name}</script>"')
        with mock.patch.object(view, "THREE", self.top / "three"):
            text = view.page([
                view.scene_of([self.run_of()]) | {"title": "a </b> title"},
                view.scene_of([self.run_of("b", summary={"scenario": "late"})])])
        for name in view.SCRIPTS:
            self.assertIn(f'"{name}<\\/script>"', text)
        start = text.index('{"scenes"')
        data, _ = json.JSONDecoder().raw_decode(text, start)
        self.assertEqual(([s["title"] for s in data["scenes"]], data["modes"]),
                         (["a </b> title", "Two of them"], ["open", "stick", "slip"]))
        self.assertNotIn("</b>", text)
        self.assertRegex(text, r"<title>[^<]*pair boxes=16 mu=0.25 start=steady, late boxes=16 mu=0.25 start=steady")

    def main(self, *words):
        with mock.patch("sys.argv", ["view.py", *map(str, words)]), mock.patch("sys.stdout", io.StringIO()) as out:
            view.main()
        return out.getvalue().strip()

    def test_flags_reach_what_they_name(self):
        a, b = self.run_of("a"), self.run_of("b")
        with mock.patch.object(view, "page", side_effect=lambda scenes: json.dumps(scenes)):
            said = self.main(a, b, "--reference", b, "--label", "left", "--label", "right", "--frames", 4, "--out",
                             self.top / "out.html")
        scene, = json.loads((self.top / "out.html").read_text())
        self.assertEqual(said, str(self.top / "out.html"))
        self.assertEqual(([run["label"] for run in scene["runs"]], [len(run["t"]) for run in scene["runs"]]),
                         (["left", "right"], [4, 4]))
        self.assertEqual(scene["curves"]["error"][0], "distance from the reference")
        self.assertEqual(self.main(a, "--frames", 2, "--gltf", self.top / "a.glb"), str(self.top / "a.glb"))
        document, _ = read_gltf((self.top / "a.glb").read_bytes())
        self.assertEqual(document["accessors"][document["animations"][0]["samplers"][0]["input"]]["count"], 2)
        for words, why in (((a, b, a), "one run, or two"), ((a, "--frames", 1), "--frames must be at least 2")):
            with mock.patch("sys.stderr", io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
                self.main(*words)
            self.assertEqual(ended.exception.code, 2)
            self.assertIn(why, said.getvalue())


def read_gltf(data):
    """(document, binary) of a .glb file."""
    magic, version, size = struct.unpack("<4sII", data[:12])
    assert (magic, version, size, size % 4) == (b"glTF", 2, len(data), 0)
    length, kind = struct.unpack("<I4s", data[12:20])
    document, rest = json.loads(data[20:20 + length]), data[20 + length:]
    assert (kind, rest[4:8], struct.unpack("<I", rest[:4])[0], length % 4) == (b"JSON", b"BIN\0", len(rest) - 8, 0)
    return document, rest[8:]


def values(document, binary, number):
    accessor = document["accessors"][number]
    part = document["bufferViews"][accessor["bufferView"]]
    wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
    assert part["byteLength"] == 4 * wide * accessor["count"] and part["buffer"] == 0
    return np.frombuffer(binary, kind, wide * accessor["count"], part["byteOffset"]).reshape(-1, wide)


class Gltf(Made):
    def test_a_shape_hangs_on_its_body_in_its_own_colour_and_what_stands_is_grey(self):
        folder = self.run_of()
        for words in range(4):  # parts of a file begin at every fourth byte
            read_gltf(gltf.file_of(view.Motion(folder, words * "x" + "y")))
        motion = view.Motion(folder, "the label")
        document, binary = read_gltf(gltf.file_of(motion))
        nodes = document["nodes"]
        self.assertEqual([node["name"] for node in nodes], ["one", "two", "ground", "s_one", "s_two", "rest"])
        self.assertEqual([node.get("children") for node in nodes], [[3], [4], None, None, None, None])
        self.assertEqual((document["scenes"][0]["nodes"], document["scenes"][0]["name"]), ([0, 1, 2, 5], motion.scene))
        self.assertEqual(document["animations"][0]["name"], "the label")
        for node, at, turn in ((0, (0, 0, 0), OTHER), (1, (10, 20, 30), QUARTER), (2, (0, -1, 0), (1, 0, 0, 0)),
                               (3, (0.1, 0.2, 0.3), OTHER), (5, (7, 8, 9), (1, 0, 0, 0))):
            np.testing.assert_allclose(nodes[node]["translation"], at, atol=1e-12)
            np.testing.assert_allclose(nodes[node]["rotation"], [*turn[1:], turn[0]], atol=1e-9)
        colours = [
            document["materials"][document["meshes"][nodes[n]["mesh"]]["primitives"][0]["material"]]["pbrMetallicRoughness"]
            ["baseColorFactor"] for n in (2, 3, 4, 5)]
        self.assertEqual((colours[0], colours[3]), ([0.6, 0.6, 0.6, 1], [0.6, 0.6, 0.6, 1]))
        self.assertEqual(colours[1:3], [[*gltf.COLOURS[0], 1], [*gltf.COLOURS[1], 1]])
        # The farthest coordinate of a body is 30: the ground is drawn to 2 + 60 on all sides.
        for name, low, high in (("ground", (-62, 0, -62), (62, 0, 62)), ("s_one", (-1, -2, -3), (1, 2, 3)),
                                ("rest", 3 * (-0.5, ), 3 * (0.5, )), ("s_two", (0, 0, 0), (1, 1, 1))):
            mesh = next(mesh for mesh in document["meshes"] if mesh["name"] == name)
            part = mesh["primitives"][0]
            points = values(document, binary, part["attributes"]["POSITION"])
            np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [low, high], atol=1e-6)
            accessor = document["accessors"][part["attributes"]["POSITION"]]
            np.testing.assert_allclose([accessor["min"], accessor["max"]], [low, high], atol=1e-6)
            self.assertEqual(len(values(document, binary, part["attributes"]["NORMAL"])), len(points))
            indices = values(document, binary, part["indices"]).ravel()
            self.assertEqual((len(indices) % 3, max(indices)), (0, len(points) - 1))
            self.assertEqual([
                document["bufferViews"][document["accessors"][n]["bufferView"]]["target"]
                for n in (part["attributes"]["POSITION"], part["indices"])], [34962, 34963])

    def test_an_animation_has_a_place_and_a_unit_quaternion_at_each_moment(self):
        folder = self.run_of()
        file = folder / "trajectory.csv"
        file.write_text(file.read_text().replace("0.1,0.7,0.5,0.5", "0.2,1.4,1,1"))  # twice as long
        motion = view.Motion(folder)
        document, binary = read_gltf(gltf.file_of(motion))
        animation, found = document["animations"][0], {}
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            self.assertEqual(sampler["interpolation"], "LINEAR")
            np.testing.assert_allclose(values(document, binary, sampler["input"]).ravel(), 0.1 * np.arange(6), rtol=1e-6)
            found[document["nodes"][channel["target"]["node"]]["name"], channel["target"]["path"]] = values(
                document, binary, sampler["output"])
        self.assertEqual(len(found), 4)
        for body, turn in (("one", OTHER), ("two", QUARTER)):
            np.testing.assert_allclose(found[body, "translation"], [place(body, n) for n in range(6)], rtol=1e-6)
            np.testing.assert_allclose(found[body, "rotation"], 6 * [[*turn[1:], turn[0]]], rtol=1e-6)
        np.testing.assert_allclose(document["nodes"][0]["rotation"], [*OTHER[1:], OTHER[0]], rtol=1e-6)
        times = document["accessors"][animation["samplers"][0]["input"]]
        np.testing.assert_allclose([times["min"], times["max"]], [[0], [0.5]], rtol=1e-6)

    def test_normals_of_a_hull_s_faces_are_of_length_one_and_outwards(self):
        top = [(-2, 0, -3), (-2, 0, 3), (2, 0, 3), (2, 0, -3)]  # seen from above counter-clockwise
        shape = {"kind": "hull", "faces": [top, [(x, -1, z) for x, _, z in top[::-1]]]}
        _, normals, _ = gltf.mesh_of(shape | {"radius": 0, "hx": 0, "hy": 0, "hz": 0}, 1)
        np.testing.assert_allclose(normals, 4 * [[0, 1, 0]] + 4 * [[0, -1, 0]], atol=1e-12)

    def test_round_shapes_stand_along_y_and_normals_are_across_their_surfaces(self):
        size = {"radius": 0.5, "hx": 0.25, "hy": 2, "hz": 0.75}
        for kind, half, curved in (("box", (0.25, 2, 0.75), 0), ("sphere", (0.5, 0.5, 0.5), 0.05),
                                   ("cylinder", (0.5, 2, 0.5), 0.01), ("capsule", (0.5, 2.5, 0.5), 0.05), ("half_space", (3, 0,
                                                                                                                          3), 0)):
            points, normals, triangles = (np.array(part) for part in gltf.mesh_of({"kind": kind, **size}, 3))
            np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [np.negative(half), half], atol=1e-9,
                                       err_msg=kind)
            np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-9)
            corner = points[triangles]
            across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
            area = np.linalg.norm(across, axis=1)
            flat = area > 1e-9  # at a pole corners fall together
            own = np.einsum("ti,tci->tc", across[flat] / area[flat, None], normals[triangles[flat]])
            self.assertGreater(own.min(), 1 - curved - 1e-9, kind)


if __name__ == "__main__":
    unittest.main()
