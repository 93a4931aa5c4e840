"""Makes a failing scene smaller while it fails the same way: fewer bodies, a shorter run, rounder numbers.

`same(path)` says whether the scene in a file still shows what is sought; it may be anything, and is asked a bounded
number of times. Bodies go in halves, then one by one (as in delta debugging); of what is left, numbers are rounded to
as few digits as keep it failing.
"""
import copy
import fnmatch
import shutil
import xml.etree.ElementTree as ET

TRIALS = 150  # questions asked of a scene at most
DIGITS = [1, 2, 3]
ROUNDED = {
    "position", "velocity", "angular_velocity", "size", "radius", "length", "mass", "quaternion", "angle", "axis", "mu",
    "restitution", "constant", "normal", "point"}


class Reduction:
    def __init__(self, path, target, same):
        self.tree, self.target, self.same, self.left = ET.parse(path), target, same, TRIALS
        target.parent.mkdir(parents=True, exist_ok=True)
        for robot in self.tree.getroot().iter("robot"):
            if "urdf" in robot.attrib:
                shutil.copy(path.parent / robot.get("urdf"), target.parent)

    def try_it(self, change):
        """Takes over a changed copy of the scene if it still fails."""
        if self.left <= 0:
            return False
        self.left -= 1
        candidate = copy.deepcopy(self.tree)
        if change(candidate.getroot()) is False:
            return False
        tidy(candidate.getroot())
        trial = self.target.with_name("trial_" + self.target.name)
        candidate.write(trial, encoding="UTF-8", xml_declaration=True)
        same = self.same(trial)
        trial.unlink()
        if same:
            self.tree = candidate
        return same

    def bodies(self):
        return [body.get("name") for body in self.tree.getroot().find("bodies")]


def names_in(root):
    names = [body.get("name") for body in root.find("bodies") if body.tag != "robot"]
    for robot in root.iter("robot"):
        names += [shape.get("name") for link in robot.iter("link") for shape in link]
        if "urdf" in robot.attrib:
            names += URDF_LINKS
    return names


URDF_LINKS = [f"l{number}" for number in range(10)]  # as scenes.py names them


def tidy(root):
    """Leaves out pairs, forces and controllers of what is not there any more."""
    names, robots = names_in(root), [robot.get("name") for robot in root.iter("robot")]
    contacts = root.find("contacts")
    for pair in list(contacts if contacts is not None else []):
        a, b = (fnmatch.filter(names, pair.get(key)) for key in "ab")
        if not a or not b or len(set(a + b)) < 2:
            contacts.remove(pair)
    controllers = root.find("controllers")
    for controller in list(controllers if controllers is not None else []):
        if controller.get("robot") not in robots:
            controllers.remove(controller)
    for parent in (contacts, controllers):
        if parent is not None and len(parent) == 0:
            root.remove(parent)


def without(names):
    def change(root):
        bodies = root.find("bodies")
        for body in list(bodies):
            if body.get("name") in names:
                bodies.remove(body)
        return any(body.tag not in ("half_space", ) for body in bodies)

    return change


def shorter(share):
    def change(root):
        simulation = root.find("simulation")
        step, duration = float(simulation.get("step")), float(simulation.get("duration"))
        steps = max(1, round(duration * share / step))
        simulation.set("duration", repr(steps * step))
        return steps < round(duration / step)  # a share of few steps may be all of them

    return change


def rounder(key, number, digits):
    def change(root):
        element = list(root.iter())[number]
        old = element.get(key)
        new = " ".join(f"{float(f'{float(word):.{digits}g}'):g}" for word in old.split())
        element.set(key, new)
        return new != old

    return change


def reduce(path, target, same):
    """Writes the smallest scene found to `target` and returns it."""
    work = Reduction(path, target, same)
    for share in (0.25, 0.5, 0.7, 0.85, 0.95):
        while work.try_it(shorter(share)):
            pass
    names = work.bodies()
    size = max(1, len(names) // 2)
    while size >= 1 and work.left > 0:
        start, gone = 0, False
        while start < len(work.bodies()):
            if work.try_it(without(work.bodies()[start:start + size])):
                gone = True
            else:
                start += size
        size = size if gone and size == 1 else size // 2
    elements = list(work.tree.getroot().iter())
    for number, element in enumerate(elements):
        for key in sorted(ROUNDED & set(element.attrib)):
            for digits in DIGITS:
                if work.try_it(rounder(key, number, digits)):
                    break
    tidy(work.tree.getroot())
    ET.indent(work.tree)
    work.tree.write(target, encoding="UTF-8", xml_declaration=True)
    return target
