"""scripts/contactbench/reduce.py: a failing scene is made smaller, step by step, while it fails the same way."""
import unittest
import xml.etree.ElementTree as ET

from contactbench import reduce
from folder import Folder


class Smaller(Folder):
    SCENE = """<scenario><simulation step="0.01" duration="0.2"/><bodies>
        <half_space name="p1"/><box name="b1" position="1.2345 0 -6.789"/>
        <box name="b2"/><robot name="r"><link name="arm"><box name="hand"/></link></robot></bodies>
        <contacts><pair a="b*" b="p1"/><pair a="b1" b="b1"/><pair a="hand" b="b2"/><pair a="gone" b="b1"/></contacts>
        <controllers><pd robot="r"/><pd robot="lost"/></controllers></scenario>"""

    def root(self):
        return ET.fromstring(self.SCENE)

    def test_what_refers_to_what_is_gone_goes_too(self):
        root = self.root()
        reduce.tidy(root)
        self.assertEqual([(p.get("a"), p.get("b")) for p in root.find("contacts")], [("b*", "p1"), ("hand", "b2")])
        self.assertEqual([c.get("robot") for c in root.find("controllers")], ["r"])
        self.assertTrue(reduce.without(["r", "b2"])(root))
        reduce.tidy(root)
        self.assertEqual([(p.get("a"), p.get("b")) for p in root.find("contacts")], [("b*", "p1")])
        self.assertIsNone(root.find("controllers"))
        # Half-spaces alone are no scene.
        self.assertFalse(reduce.without(["b1"])(root))

    def test_each_robot_keeps_its_own_controller(self):
        root = ET.fromstring('<scenario><bodies><robot name="a"/><robot name="b"/><robot name="c"/></bodies><controllers>'
                             '<pd robot="c"/><pd robot="b"/><pd robot="a"/></controllers></scenario>')
        reduce.tidy(root)
        self.assertEqual([c.get("robot") for c in root.find("controllers")], ["c", "b", "a"])
        self.assertTrue(reduce.without(["b"])(root))
        reduce.tidy(root)
        self.assertEqual([c.get("robot") for c in root.find("controllers")], ["c", "a"])

    def test_links_of_a_robot_s_own_file_have_its_names(self):
        root = ET.fromstring('<scenario><bodies><box name="b1"/><robot name="r" urdf="r.urdf"/></bodies></scenario>')
        self.assertEqual(reduce.names_in(root), ["b1", *(f"l{n}" for n in range(10))])

    def test_a_run_is_shortened_by_whole_steps_down_to_one(self):
        for duration, share, left, changed in (("0.2", 0.25, 0.05, True), ("0.2", 0.87, 0.17, True), ("0.02", 0.25, 0.01, True),
                                               ("0.01", 0.5, 0.01, False)):
            root = self.root()
            root.find("simulation").set("duration", duration)
            self.assertEqual(reduce.shorter(share)(root), changed)
            self.assertAlmostEqual(float(root.find("simulation").get("duration")), left, delta=1e-12)

    def test_numbers_are_rounded_to_so_many_digits(self):
        root = self.root()
        number = [element.get("name") for element in root.iter()].index("b1")
        for digits, position in ((3, "1.23 0 -6.79"), (1, "1 0 -7")):
            self.assertTrue(reduce.rounder("position", number, digits)(root))
            self.assertEqual(root.find("bodies")[1].get("position"), position)
        self.assertFalse(reduce.rounder("position", number, 1)(root))

    def test_a_trial_is_asked_so_often_and_leaves_no_file(self):
        path = self.top / "scene.xml"
        path.write_text(self.SCENE.replace('<robot name="r">', '<robot name="r" urdf="arm.urdf">'))
        (self.top / "arm.urdf").write_text("the robot")
        asked = []

        def same(trial):
            asked.append((trial.name, trial.exists()))
            return len(asked) % 2 == 0

        work = reduce.Reduction(path, self.top / "out/small.xml", same)
        self.assertEqual((self.top / "out/arm.urdf").read_text(), "the robot")
        self.assertEqual(work.bodies(), ["p1", "b1", "b2", "r"])
        self.assertFalse(work.try_it(reduce.without(["b1"])))
        self.assertEqual(work.bodies(), ["p1", "b1", "b2", "r"])
        self.assertTrue(work.try_it(reduce.without(["b1"])))
        self.assertEqual(work.bodies(), ["p1", "b2", "r"])
        self.assertFalse(work.try_it(lambda root: False))  # no change is not asked
        self.assertEqual(asked, [("trial_small.xml", True)] * 2)
        self.assertEqual([p.name for p in (self.top / "out").iterdir()], ["arm.urdf"])
        self.assertEqual(work.left, reduce.TRIALS - 3)
        work.left = 0
        self.assertFalse(work.try_it(reduce.without(["b2"])))
        self.assertEqual(len(asked), 2)

    def test_bodies_go_in_halves_and_then_one_by_one_and_a_run_in_quarters(self):
        path = self.top / "scene.xml"
        boxes = "".join(f'<box name="b{n}" position="0.12345 {n} 0"/>' for n in range(16))
        path.write_text(f'<scenario><simulation step="0.001" duration="1.024"/><bodies>{boxes}</bodies></scenario>')
        for needed in ({"b15"}, {"b0", "b9"}, {"b3", "b4", "b12"}):
            asked = []

            def same(trial, needed=needed, asked=asked):
                root = ET.parse(trial).getroot()
                places = [b.get("position").split()[0] for b in root.find("bodies") if b.get("name") in needed]
                asked.append((len(root.find("bodies")), float(root.find("simulation").get("duration"))))
                # It takes 5 ms, and a place of 0.12 to the second digit.
                return len(places) == len(needed) and asked[-1][1] >= 0.005 and all(abs(float(x) - 0.12) < 0.01 for x in places)

            root = ET.parse(reduce.reduce(path, self.top / "out/small.xml", same)).getroot()
            self.assertEqual({b.get("name") for b in root.find("bodies")}, needed)
            self.assertEqual({b.get("position").split()[0] for b in root.find("bodies")}, {"0.12"})
            self.assertAlmostEqual(float(root.find("simulation").get("duration")), 0.005, delta=1e-3)
            self.assertEqual([t for _, t in asked[:3]], [0.256, 0.064, 0.016])
            self.assertEqual(next(n for n, _ in asked if n < 16), 8)
            self.assertLess(len(asked), 80)

    def test_what_can_go_only_after_another_goes_in_another_round(self):
        path = self.top / "scene.xml"
        boxes = "".join(f'<box name="b{n}"/>' for n in range(3))
        path.write_text(f'<scenario><simulation step="1" duration="1"/><bodies>{boxes}</bodies></scenario>')

        def same(trial):
            names = {body.get("name") for body in ET.parse(trial).getroot().find("bodies")}
            return "b0" in names and not ("b2" in names and "b1" not in names)  # b2 stands on b1

        root = ET.parse(reduce.reduce(path, self.top / "small.xml", same)).getroot()
        self.assertEqual([body.get("name") for body in root.find("bodies")], ["b0"])


if __name__ == "__main__":
    unittest.main()
