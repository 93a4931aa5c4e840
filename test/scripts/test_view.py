"""scripts/view.py on runs of the real program ($PROGRAM): the page in a browser without network, glTF in another library."""
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import browser
import numpy as np
import pandas as pd

from contactbench import gltf, program, still, view

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("PROGRAM", program.DEFAULT)
DOMINOES = """<scenario title="Ten dominoes"><simulation step="1e-3" duration="0.4" k="4"/><reference kind="missing"/>
<gravity constant="0 -9.81 0"/><bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<array count="10" offset="0.1 0 0"><box name="d" size="0.03 0.2 0.1" mass="0.1" position="0 0.1 0"/></array>
<sphere name="ball" radius="0.04" mass="0.2" position="-0.2 0.16 0" velocity="2 0 0"/></bodies><contacts>
<pair a="d_*" b="ground" mu="0.5"/><pair a="d_*" b="d_*" mu="0.2"/><pair a="ball" b="d_1" mu="0.1"/><pair a="ball" b="ground" mu="0.5"/>
</contacts></scenario>"""

ROCKS = """<scenario title="A stone and a rod"><simulation step="1e-3" duration="0.02" k="4"/><reference kind="missing"/>
<gravity constant="0 -9.81 0"/><bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<hull name="stone" points="0 0 0  1 0 0  0 0 1  0.2 1 0.2" mass="1" position="0 0 0"/>
<capsule name="rod" radius="0.1" length="1" mass="1" position="3 0.6 0"/></bodies><contacts><pair a="*" b="ground" mu="0.5"/></contacts></scenario>"""

GRAIN = """<scenario title="A grain of a millimetre"><simulation step="1e-3" duration="0.01" k="4"/><reference kind="missing"/>
<gravity constant="0 -9.81 0"/><bodies><half_space name="ground" point="0 0 0" normal="0 1 0"/>
<box name="grain" size="1e-3 1e-3 1e-3" mass="1e-6" position="0 5e-4 0"/></bodies>
<contacts><pair a="grain" b="ground" mu="0.5"/></contacts></scenario>"""


def setUpModule():
    global MADE
    MADE = Path(tempfile.mkdtemp())
    unittest.addModuleCleanup(shutil.rmtree, MADE, ignore_errors=True)
    (MADE / "dominoes.xml").write_text(DOMINOES)
    (MADE / "rocks.xml").write_text(ROCKS)
    (MADE / "grain.xml").write_text(GRAIN)
    for name, scene, *flags in (("stack_ap", "stack", "--method", "ap", "--set", "boxes=16", "--duration", "0.2", "--record-every", "2"),
                                ("stack_convex", "stack", "--method", "convex", "--set", "boxes=16", "--duration", "0.2"),
                                ("grasp", "grasp", "--method", "convex", "--duration", "0.2"),
                                ("rocks", MADE / "rocks.xml", "--method", "convex"),
                                ("grain", MADE / "grain.xml", "--method", "coulomb"),
                                ("dominoes", MADE / "dominoes.xml", "--method", "convex", "--record-every", "4")):
        ended = program.call(PROGRAM, "run", scene, *flags, "--record-contacts", "--out", MADE / name, "--quiet", "--time-limit", 60)
        if ended.returncode not in (0, 3):
            raise AssertionError(ended.stderr)


def script(*words, code=0):
    ended = subprocess.run([sys.executable, "-B", str(ROOT / "scripts/view.py"), *map(str, words)], capture_output=True, text=True)
    if ended.returncode != code:
        raise AssertionError(ended.stdout + ended.stderr)
    return ended.stdout + ended.stderr


class Motions(unittest.TestCase):
    def test_the_contacts_of_a_stack_at_rest_bear_what_is_above_them(self):
        motion = view.Motion(MADE / "stack_convex")
        last = motion.contacts[-1]
        weight = 9.8 * float(motion.summary["options"]["step"])
        # Sixteen boxes of the same mass: the interfaces bear 1, 2, ... 16 of them; impulses are drawn upwards.
        mass = sorted(last.groupby(last["py"].round(2))["ry"].sum())
        np.testing.assert_allclose(np.array(mass) / mass[0], np.arange(1, 17), rtol=1e-6)
        self.assertGreater(mass[0], 0.1 * weight)

    def test_an_impulse_is_drawn_on_what_moves_and_of_two_on_the_upper_one(self):
        rows = pd.DataFrame([["box", "ground", 2.0], ["ground", "ball", -3.0], ["box", "ball", -1.0], ["ball", "cup", 4.0]], columns=["a", "b", "ry"])
        rows = rows.assign(end=0.5, px=np.arange(4.0), py=0.0, pz=0.0, rx=[1.0, 1.0, 0.5, 0.5], rz=0.0, mode="slip")
        made = view.merged(rows, ["ground"])[0.5].sort_index(level="px")
        np.testing.assert_array_equal(made["ry"], [2, 3, 1, 4])
        np.testing.assert_array_equal(made["rx"], [1, -1, -0.5, 0.5])

    def test_two_that_move_alike_are_not_apart_and_a_shift_is_their_distance(self):
        motion = view.Motion(MADE / "stack_convex")
        places = motion.places()
        self.assertEqual(max(view.apart(places, places)["v"]), 0.0)
        shifted = {key: place + np.array([3e-3, 4e-3, 0]) for key, place in places.items()}
        self.assertAlmostEqual(max(view.apart(places, shifted)["v"]), 5e-3, 6)

    def test_capsules_and_hulls_are_drawn_and_their_surfaces_are_in_the_page(self):
        motion = view.Motion(MADE / "rocks")
        surfaces = {s["shape"]: s for s in motion.surfaces()}
        self.assertEqual(surfaces["stone"]["kind"], "hull")
        self.assertEqual(sorted(len(face) for face in surfaces["stone"]["faces"]), [3, 3, 3, 3])
        self.assertEqual(surfaces["rod"]["kind"], "capsule")
        self.assertNotIn("faces", surfaces["rod"])
        self.assertEqual(motion.page()["shapes"][1]["faces"], surfaces["stone"]["faces"])
        picture = still.svg(motion)
        self.assertGreater(picture.count("<polygon"), 2 * 4)
        self.assertTrue(gltf.file_of(motion).startswith(b"glTF"))

    def test_the_points_of_what_is_small_are_several(self):
        last = view.Motion(MADE / "grain").contacts[-1]
        self.assertEqual(len(last), 4)
        np.testing.assert_allclose(last["ry"].sum(), 1e-6 * 9.81 * 1e-3, rtol=1e-6)
        self.assertEqual(view.decimals(view.Motion(MADE / "stack_ap").shapes), 3)

    def test_a_body_may_be_called_what_tables_call_a_missing_value(self):
        (MADE / "null").mkdir(exist_ok=True)
        for file in (MADE / "rocks").glob("*.csv"):
            (MADE / "null" / file.name).write_text(re.sub(r"\brod\b", "null", file.read_text()))
        motion = view.Motion(MADE / "null")
        self.assertEqual(motion.bodies, ["stone", "null"])
        self.assertEqual(motion.page()["shapes"][2]["body"], "null")

    def test_what_cannot_be_drawn_is_said_with_its_remedy(self):
        (MADE / "none").mkdir(exist_ok=True)
        self.assertIn("--record-contacts", script(MADE / "none", code=1))
        self.assertIn("no run and no reference", script(MADE / "grasp", "--reference", MADE / "nowhere", "--out", MADE / "x.html", code=1))
        with tempfile.TemporaryDirectory() as empty, self.assertRaisesRegex(program.ProgramError, "libjs-three"):
            before, view.THREE = view.THREE, Path(empty)
            try:
                view.page([])
            finally:
                view.THREE = before


    def test_a_shape_turned_in_a_turned_body_stands_where_the_body_turns_it(self):
        # A box turned about x by 30 degrees in a body turned about y by 50.
        half = np.radians([15, 25])
        in_body, body = (np.sin(half[0]), 0, 0, np.cos(half[0])), (0, np.sin(half[1]), 0, np.cos(half[1]))

        class Still:
            bodies, poses = ["b"], [[np.array([1.0, 2, 3, *body])]]

            @staticmethod
            def surfaces():
                return [{"kind": "box", "body": "b", "hx": 0.1, "hy": 0.2, "hz": 0.4, "radius": 0, "px": 0.5, "py": 0, "pz": 0,
                         **dict(zip(("qx", "qy", "qz", "qw"), in_body))}]

        def about(axis, angle, v):
            axis = np.array(axis, dtype=float)
            return v * np.cos(angle) + np.cross(axis, v) * np.sin(angle) + axis * (axis @ v) * (1 - np.cos(angle))

        corners = [about((0, 1, 0), 2 * half[1], np.array([0.5, 0, 0]) + about((1, 0, 0), 2 * half[0], np.array([x, y, z]))) + (1, 2, 3)
                   for x in (-0.1, 0.1) for y in (-0.2, 0.2) for z in (-0.4, 0.4)]
        expected = np.array([[c @ still.RIGHT, -(c @ still.UP)] for c in corners])
        faces = list(still.faces_at(Still, 0))
        self.assertEqual(len(faces), 3)
        for _, flat, *_ in faces:
            for point in flat:
                self.assertLess(np.linalg.norm(expected - point, axis=1).min(), 1e-12)


class Gltf(unittest.TestCase):
    def test_surfaces_are_closed_and_face_outwards(self):
        box, ball, tin = (dict(zip(("kind", "radius", "hx", "hy", "hz"), of))
                          for of in (("box", 0, 1, 2, 3), ("sphere", 2, 0, 0, 0), ("cylinder", 1, 1, 2, 1)))
        pill = {"kind": "capsule", "radius": 1, "hx": 1, "hy": 2, "hz": 1}
        corners = np.array([[-1, -1, -1], [3, -1, -1], [-1, 3, -1], [-1, -1, 3.0]]) / 2
        tetrahedron = {"kind": "hull", "faces": [corners[list(f)].tolist() for f in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))]}
        for shape, volume, share in ((box, 48, 1e-12), (ball, 4 / 3 * np.pi * 8, 0.02), (tin, np.pi * 4, 0.02),
                                     (pill, np.pi * (4 + 4 / 3), 0.02), (tetrahedron, 8 / 6, 1e-12)):
            points, normals, triangles = (np.array(x, dtype=float) for x in gltf.mesh_of(shape, 1))
            corner = points[triangles.astype(int)]
            # The signed volume is that of the body where every triangle is seen from outside anticlockwise.
            signed = np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6
            self.assertAlmostEqual(signed / volume, 1, delta=share, msg=shape["kind"])
            self.assertTrue((np.einsum("ij,ij->i", points, normals) > 0).all(), shape["kind"])

    def test_the_file_holds_the_motion(self):
        motion = view.Motion(MADE / "dominoes")
        data = gltf.file_of(motion)
        self.assertEqual(struct.unpack("<4sII", data[:12]), (b"glTF", 2, len(data)))
        size = struct.unpack("<I", data[12:16])[0]
        document, binary = json.loads(data[20:20 + size]), data[28 + size:]
        rows = view.table(MADE / "dominoes" / "trajectory.csv")
        for number, body in enumerate(motion.bodies):
            of, node = rows[rows["body"] == body], document["nodes"][document["animations"][0]["channels"][2 * number]["target"]["node"]]
            self.assertEqual(node["name"], body)
            for channel, path, columns in zip(document["animations"][0]["channels"][2 * number:], ("translation", "rotation"), (["px", "py", "pz"], ["qx", "qy", "qz", "qw"])):
                self.assertEqual(channel["target"], {"node": channel["target"]["node"], "path": path})
                accessor = document["accessors"][document["animations"][0]["samplers"][channel["sampler"]]["output"]]
                start = document["bufferViews"][accessor["bufferView"]]["byteOffset"]
                found = np.frombuffer(binary, "<f4", len(columns) * accessor["count"], start).reshape(-1, len(columns))
                np.testing.assert_allclose(found, of[columns].to_numpy()[np.searchsorted(of["t"], motion.t - 1e-9)], atol=1e-6)
                np.testing.assert_allclose(node[path], of[columns].iloc[0], atol=1e-12)  # before it plays

    @unittest.skipUnless(shutil.which("assimp"), "assimp is not installed (assimp-utils): no other library reads the glTF")
    def test_another_library_reads_it(self):
        for name, bodies in (("stack_ap", 16), ("grasp", None), ("dominoes", 11)):
            script(MADE / name, "--gltf", MADE / f"{name}.glb")
            ended = subprocess.run(["assimp", "info", MADE / f"{name}.glb"], capture_output=True, text=True)
            self.assertEqual(ended.returncode, 0, ended.stdout[-500:])
            self.assertRegex(ended.stdout, r"Animations:\s+1\b")
            if bodies:
                self.assertRegex(ended.stdout, rf"Animation Channels:\s+{bodies}\b|Meshes:\s+{bodies + 1}\b")


@unittest.skipUnless(browser.CHROMIUM, browser.WHY_NOT)
@unittest.skipUnless(view.THREE.is_dir(), "libjs-three is not installed: there is no page")
class Browser(unittest.TestCase):
    def shot(self, page, where, size="1000,800"):
        picture = MADE / "shot.png"
        picture.unlink(missing_ok=True)
        ended = browser.browse(page, f"--window-size={size}", "--hide-scrollbars", "--virtual-time-budget=3000", f"--screenshot={picture}", where=where)
        self.assertEqual(browser.faults(ended), [])
        return picture.read_bytes()

    def test_the_pages_are_small_and_show_what_moves_without_a_network(self):
        for name, runs, late in (("stack", ("stack_ap", "stack_convex"), "0.2"), ("grasp", ("grasp", ), "0.2"),
                                 ("dominoes", ("dominoes", ), "0.39")):
            page = MADE / f"{name}.html"
            script(*(MADE / run for run in runs), "--out", page)
            self.assertLess(page.stat().st_size, 3_000_000, name)
            self.assertIsNone(re.search(r'(src|href)="(?!data:)', page.read_text()[:20000]), "something is loaded from outside")
            first, last = (self.shot(page, f"t={t}") for t in ("0", late))
            self.assertNotEqual(first, last, name)
        self.assertNotEqual(self.shot(page, "t=0&theme=dark"), first)
        self.shot(page, "t=0.2", "390,844")


if __name__ == "__main__":
    unittest.main()
