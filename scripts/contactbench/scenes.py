"""Random scenes: families of them, each tame or wild, every one determined by (seed, number) alone.

A scene is one XML file (and a URDF file beside it, where a robot comes from one). Numbers are drawn with Python's own
generator, whose sequence is fixed by its documentation, and rounded to four digits: the same bytes on every machine.
Nothing penetrates at the start, by construction: bodies stand flush on each other or in cells wider than they are;
`look.initial_penetration` checks it.

RANGES is the one place that says from where numbers are drawn; docs/campaign.md shows it.
"""
import math
import random

from .templates import TEMPLATES, render

# kind: {quantity: (low, high) or the values to choose from}. mass_kg is drawn evenly in its logarithm.
RANGES = {
    "tame": {
        "density_kg_per_m3": [1000.0], "mass_kg": None, "mu": (0.2, 0.8), "restitution": [0.0], "gravity_m_per_s2": [
            9.8], "size_m": (0.1, 0.5), "speed_m_per_s": (0.0, 2.0), "spin_rad_per_s": (0.0, 5.0), "slope": (0.1, 0.6)},
    "wild": {
        "density_kg_per_m3": None, "mass_kg": (1e-3, 1e3), "mu": (0.0, 1.5), "restitution": (0.0, 1.0),
        "gravity_m_per_s2": [9.8, 30.0], "size_m": (0.1, 0.6), "speed_m_per_s": (0.0, 5.0),
        "spin_rad_per_s": (0.0, 20.0), "slope": (0.1, 1.5)}, }
# Of both kinds.
DURATION = (0.3, 0.5)  # s
STEP = 1e-3  # s
EDGES = [4, 8]  # of ap's polygon
WILD_ZERO = 0.3  # share of wild pairs whose mu, and of those whose restitution, is exactly 0
KINDS = list(RANGES)


def rounded(x, digits=4):
    return float(f"{x:.{digits}g}") + 0.0  # no -0.0


def text(*numbers):
    return " ".join(repr(float(x) + 0.0) for x in numbers)


# Of belts, carts and trees of links; numbers in them are printed as everywhere.
ROBOTS = TEMPLATES.get_template("robots.xml").make_module({"floats": text})


class Draw:
    """Numbers of one scene, of a collection of families."""
    def __init__(self, seed, number, kind, collection=""):
        self.random = random.Random(f"contactbench {collection}{seed} {number}")
        self.kind, self.ranges = kind, RANGES[kind]

    def uniform(self, low, high):
        return rounded(low + (high - low) * self.random.random())

    def integer(self, low, high):
        return low + int((high - low + 1) * self.random.random())

    def chance(self, share):
        return self.random.random() < share

    def one_of(self, values):
        return values[int(len(values) * self.random.random())]

    def of(self, quantity):
        """A number out of the kind's range of this quantity."""
        values = self.ranges[quantity]
        return self.one_of(values) if isinstance(values, list) else self.uniform(*values)

    def signed(self, quantity):
        return self.one_of([-1, 1]) * self.of(quantity)

    def vector(self, longest):
        """Each component up to `longest` / sqrt(3), so that its length is at most `longest`."""
        most = longest / math.sqrt(3)
        return [self.uniform(-most, most) for _ in range(3)]

    def mass(self):
        """The attribute of a free body."""
        if self.ranges["mass_kg"] is None:
            return f'density="{text(self.of("density_kg_per_m3"))}"'
        low, high = self.ranges["mass_kg"]
        return f'mass="{text(rounded(low * (high / low) ** self.random.random()))}"'

    def mass_of(self, volume):
        """As a number, of a link."""
        if self.ranges["mass_kg"] is None:
            return rounded(volume * self.of("density_kg_per_m3"))
        low, high = self.ranges["mass_kg"]
        return rounded(low * (high / low)**self.random.random())

    def law(self):
        """Attributes of a pair."""
        mu, restitution = self.of("mu"), self.of("restitution")
        if self.kind == "wild":
            mu = 0.0 if self.chance(WILD_ZERO) else mu
            restitution = 0.0 if self.chance(WILD_ZERO) else restitution
        return f'mu="{text(mu)}"' + (f' restitution="{text(restitution)}"' if restitution else "")

    def quaternion(self):
        while True:
            q = [rounded(2 * self.random.random() - 1, 3) for _ in range(4)]
            if 0.1 < sum(x * x for x in q) <= 1:
                return f'quaternion="{text(*q)}"'


class Scene:
    """The parts of one XML file, in the order in which they are added."""
    def __init__(self, draw, family, name):
        self.draw, self.family, self.kind, self.name = draw, family, draw.kind, name
        self.g = draw.of("gravity_m_per_s2")
        self.gravity = [0.0, -self.g, 0.0]
        self.k, self.duration = draw.one_of(EDGES), draw.uniform(*DURATION)
        self.bodies, self.pairs, self.controllers = [], [], []
        self.count = {"p": 0, "b": 0}
        self.files = {}  # further files: name -> content

    def next(self, letter):
        self.count[letter] += 1
        return f"{letter}{self.count[letter]}"

    def plane(self, point, normal):
        self.bodies.append(f'<half_space name="{self.next("p")}" point="{text(*point)}" normal="{text(*normal)}"/>')

    def free(self, kind, extents, position, motion="", turn=""):
        """A free body; `extents` are its attributes."""
        words = [
            f'<{kind} name="{self.next("b")}" {extents} {self.draw.mass()} position="{text(*position)}"', turn, motion]
        self.bodies.append(" ".join(w for w in words if w) + "/>")

    def box(self, size, position, motion="", turn=""):
        self.free("box", f'size="{text(*size)}"', position, motion, turn)

    def sphere(self, radius, position, motion=""):
        self.free("sphere", f'radius="{text(radius)}"', position, motion)

    def cylinder(self, radius, length, position, motion="", turn=""):
        self.free("cylinder", f'radius="{text(radius)}" length="{text(length)}"', position, motion, turn)

    def disc(self, radius, position, motion="", turn=""):
        """Without length, so that its mass is that of a thin coin."""
        mass = self.draw.mass_of(0.1 * math.pi * radius**3)
        words = [
            f'<cylinder name="{self.next("b")}" radius="{text(radius)}" length="0.0" mass="{text(mass)}" '
            f'position="{text(*position)}"', turn, motion]
        self.bodies.append(" ".join(w for w in words if w) + "/>")

    def fixed_box(self, size, position):
        self.bodies.append(
            f'<box name="{self.next("p")}" size="{text(*size)}" fixed="yes" position="{text(*position)}"/>')

    def capsule(self, radius, length, position, motion="", turn=""):
        self.free("capsule", f'radius="{text(radius)}" length="{text(length)}"', position, motion, turn)

    def hull(self, points, position, motion="", turn=""):
        self.free("hull", f'points="{text(*(x for point in points for x in point))}"', position, motion, turn)

    def pair(self, a, b):
        self.pairs.append(f'<pair a="{a}" b="{b}" {self.draw.law()}/>')

    def among(self):
        """The usual pairs: bodies with planes and with each other."""
        self.pair("b*", "p*")
        if self.count["b"] > 1:
            self.pair("b*", "b*")

    def one_by_one(self, ground):
        """Each body with what carries it, and each two of them, by laws of their own."""
        names = [f"b{i + 1}" for i in range(self.count["b"])]
        for i, name in enumerate(names):
            self.pair(name, ground)
            for other in names[:i]:
                self.pair(name, other)

    def xml(self):
        return render("scene.xml", scene=self, step=STEP, floats=text)


def moving(v=None, w=None):
    words = [f'velocity="{text(*v)}"' if v and any(v) else "", f'angular_velocity="{text(*w)}"' if w and any(w) else ""]
    return " ".join(word for word in words if word)


def drawn_motion(draw):
    """One body in four starts at rest, one in four without spin."""
    if draw.chance(0.25):
        return ""
    return moving(draw.vector(draw.of("speed_m_per_s")),
                  None if draw.chance(1 / 3) else draw.vector(draw.of("spin_rad_per_s")))


def flush_size(draw):
    return [draw.of("size_m") for _ in range(3)]


def in_cells(scene, count, places, kinds=("box", "box", "sphere")):
    """`count` bodies, turned and moving at random, in cells of a grid; `places(cell number, cell width)` is a cell's
    centre. A cell is as wide as the largest body's sphere around it."""
    draw = scene.draw
    largest = draw.uniform(0.25, 1) * scene.draw.ranges["size_m"][1]
    cell = rounded(1.03 * math.sqrt(3) * largest)
    for number in range(count):
        motion = drawn_motion(draw)
        place = [round(x, 6) for x in places(number, cell)]
        kind = draw.one_of(kinds)
        if kind == "box":
            upright = draw.chance(0.3)
            scene.box([rounded(largest * draw.uniform(0.4, 1)) for _ in range(3)], place, motion,
                      "" if upright else draw.quaternion())
        elif kind == "sphere":
            scene.sphere(rounded(0.5 * largest * draw.uniform(0.4, 1.5)), place, motion)
        elif kind == "capsule":
            radius = rounded(0.5 * largest * draw.uniform(0.2, 0.8))
            scene.capsule(radius, rounded(1.7 * largest - 2 * radius), place, motion, draw.quaternion())
        elif kind == "hull":
            scene.hull(rock(draw, 0.8 * largest), place, motion, draw.quaternion())
        elif kind == "prism":
            size = [rounded(0.55 * largest * draw.uniform(0.4, 1)) for _ in range(2)]
            scene.hull(prism(draw, *size), place, motion, draw.quaternion())
        elif kind == "disc":
            scene.disc(rounded(0.6 * largest * draw.uniform(0.4, 1)), place, motion, draw.quaternion())
        else:
            scene.cylinder(rounded(0.5 * largest * draw.uniform(0.4, 1)), rounded(largest * draw.uniform(0.2, 1)),
                           place, motion, draw.quaternion())
    return cell


def grid(across):
    """Layers of across x across cells about the y axis, the lowest on the floor."""
    def place(number, cell):
        layer, rest = divmod(number, across * across)
        return [(rest % across - (across - 1) / 2) * cell, (layer + 0.5) * cell,
                (rest // across - (across - 1) / 2) * cell]

    return place


def crowd(draw):
    """5 to 30 bodies, few more often than many."""
    share = draw.uniform(0, 1)
    return 5 + int(25.999 * share * share)


def pile(scene):
    scene.plane([0, 0, 0], [0, 1, 0])
    in_cells(scene, crowd(scene.draw), grid(3))
    scene.among()


def in_bin(scene):
    cell = in_cells(scene, crowd(scene.draw), grid(3))
    far = rounded(1.5 * cell)
    scene.plane([0, 0, 0], [0, 1, 0])
    for x, z in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        scene.plane([x * far, 0, z * far], [-x, 0, -z])
    scene.among()


def stack(scene):
    """One of its boxes is kicked."""
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    count, foot, y = draw.integer(5, 7), [draw.uniform(0.2, 0.5), draw.uniform(0.2, 0.5)], 0.0
    kicked = draw.integer(0, count - 1)
    for number in range(count):
        height = draw.uniform(0.05, 0.3)
        motion = ""
        if number == kicked:
            motion = moving(
                [draw.signed("speed_m_per_s"), 0.0, draw.signed("speed_m_per_s")],
                [0.0, draw.signed("spin_rad_per_s"), 0.0])
        shift = [draw.uniform(-0.02, 0.02), draw.uniform(-0.02, 0.02)] if draw.chance(0.5) else [0.0, 0.0]
        scene.box([foot[0], height, foot[1]], [shift[0], round(y + height / 2, 8), shift[1]], motion)
        y += height
    scene.among()


def dominoes(scene):
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    height, thick, wide = draw.uniform(0.2, 0.5), draw.uniform(0.02, 0.06), draw.uniform(0.1, 0.2)
    apart = rounded(thick + height * draw.uniform(0.15, 0.6))
    spin = draw.uniform(2, 8)
    falling = moving([rounded(spin * height / 2), rounded(spin * thick / 2), 0.0], [0.0, 0.0, -spin])
    for number in range(draw.integer(5, 12)):
        first = falling if number == 0 else ""  # turns about its lower edge at its front
        yaw = f'axis="0 1 0" angle="{text(draw.uniform(-0.1, 0.1))}"' if draw.chance(0.3) else ""
        scene.box([thick, height, wide], [round(number * apart, 8), height / 2, 0.0], first, yaw)
    scene.among()


def wall(scene):
    """Bricks in running bond, hit by a ball."""
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    long, high, deep = draw.uniform(0.2, 0.5), draw.uniform(0.1, 0.25), draw.uniform(0.1, 0.25)
    across, courses = draw.integer(2, 3), draw.integer(2, 3)
    for course in range(courses):
        for number in range(across):
            scene.box([long, high, deep], [
                round((number - (across - 1) / 2 + 0.5 * (course % 2)) * long, 8),
                round((course + 0.5) * high, 8), 0.0])
    radius = draw.uniform(0.05, 0.2)
    speed = draw.uniform(1, 8)
    aside, height = draw.uniform(-0.2, 0.2), max(radius, draw.uniform(0.3, 1) * courses * high)
    place = [aside, height, -rounded(deep / 2 + radius + speed * 0.1)]
    scene.sphere(radius, place,
                 moving([draw.uniform(-0.3, 0.3), draw.uniform(0, 1), speed], draw.vector(draw.of("spin_rad_per_s"))))
    scene.among()


ROUND = [(1.0, 0.0), (0.707, 0.707), (0.0, 1.0), (-0.707, 0.707), (-1.0, 0.0), (-0.707, -0.707), (0.0, -1.0),
         (0.707, -0.707)]


def bowl(scene):
    """Spheres in a bowl of tilted planes, with a floor or pointed."""
    draw = scene.draw
    cell = in_cells(scene, draw.integer(5, 15), grid(2), ["sphere"] if draw.chance(0.7) else ["sphere", "box"])
    far, steep = rounded(2 * cell * draw.uniform(1, 1.2)), draw.uniform(0.3, 1.5)
    for x, z in ROUND[::draw.one_of([1, 2])]:
        scene.plane([x * far, 0, z * far], [-x, steep, -z])
    if draw.chance(0.6):
        scene.plane([0, 0, 0], [0, 1, 0])
    scene.among()


def ramp(scene):
    """Bodies on a slope: flush, where gravity is tilted in place of the plane; or dropped on it."""
    draw = scene.draw
    slope, count = draw.of("slope"), draw.integer(5, 12)
    if draw.chance(0.5):
        steep = math.sqrt(1 + slope * slope)
        scene.gravity = [rounded(scene.g * slope / steep), -rounded(scene.g / steep), 0.0]
        scene.plane([0, 0, 0], [0, 1, 0])
        for number in range(count):
            size = flush_size(draw)
            motion = moving([draw.signed("speed_m_per_s"), 0.0,
                             draw.signed("speed_m_per_s")]) if draw.chance(0.4) else ""
            x = 0.9 * scene.draw.ranges["size_m"][1] * number * 2
            if draw.chance(0.25):
                scene.sphere(size[0] / 2, [round(x, 6), size[0] / 2, 0.0], motion)
            else:
                scene.box(size, [round(x, 6), size[1] / 2, 0.0], motion)
    else:
        normal = [rounded(slope), 1.0, draw.uniform(-0.3, 0.3)]
        length = math.sqrt(sum(x * x for x in normal))
        scene.plane([0, 0, 0], normal)
        in_cells(scene, count,
                 lambda number, cell: [number * cell, 0.51 * cell * length - normal[0] * number * cell, 0.0])
    scene.among()


def corner(scene):
    """Boxes on the floor slide into two walls."""
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    most = scene.draw.ranges["size_m"][1]
    apart = rounded(1.5 * most)
    far = [rounded(0.75 * most + draw.uniform(0, 0.3)) for _ in range(2)]
    scene.plane([far[0], 0, 0], [-1, 0, 0])
    scene.plane([0, 0, far[1]], [0, 0, -1])
    speed = draw.uniform(1, 4)
    heading = [rounded(speed * draw.uniform(0.3, 1)), 0.0, rounded(speed * draw.uniform(0.3, 1))]
    for number in range(draw.integer(5, 9)):
        size = flush_size(draw)
        across, along = number % 3, number // 3
        scene.box(size, [-across * apart, size[1] / 2, -along * apart],
                  moving(heading, [0.0, draw.signed("spin_rad_per_s") if draw.chance(0.3) else 0.0, 0.0]),
                  f'axis="0 1 0" angle="{text(draw.uniform(-3, 3))}"')
    scene.among()


def wedge(scene):
    """Bodies fall between two tilted planes."""
    draw = scene.draw
    tilt = draw.uniform(0.3, 1.5)
    length = math.sqrt(1 + tilt * tilt)
    scene.plane([0, 0, 0], [1, tilt, 0])
    scene.plane([0, 0, 0], [-1, tilt, 0])
    lanes = draw.integer(2, 4)
    in_cells(scene, draw.integer(5, 12),
             lambda number, cell: [0.0, (0.51 * length / tilt + number // lanes) * cell, number % lanes * cell])
    scene.among()


def on_top(scene, along, y):
    """Boxes, two of them on each other, and balls, at rest on a level surface."""
    draw = scene.draw
    apart = rounded(1.5 * draw.ranges["size_m"][1])
    for number in range(draw.integer(3, 6)):
        x, size = round((number - 1.5) * apart + along, 6), flush_size(draw)
        if draw.chance(0.25):
            scene.sphere(size[0] / 2, [x, round(y + size[0] / 2, 8), 0.0])
            continue
        scene.box(size, [x, round(y + size[1] / 2, 8), 0.0])
        if draw.chance(0.5):
            upper = [rounded(0.9 * s) for s in size]
            scene.box(upper, [x, round(y + size[1] + upper[1] / 2, 8), 0.0])


def belt(scene):
    """One belt, or two side by side that run at different rates, moved by a joint whose limits move."""
    draw = scene.draw
    two = draw.chance(0.4)
    for number in range(2 if two else 1):
        rate, z = draw.signed("speed_m_per_s"), (number - 0.5) * 2 if two else 0.0
        scene.bodies.append(ROBOTS.belt(number, rate, [0.0, -0.1, z]))
    on_top(scene, 0.0, 0.0)
    scene.one_by_one("belt*")


def cart(scene):
    """A cart on a rail, driven along a sine, carries bodies."""
    draw = scene.draw
    amplitude, frequency = draw.uniform(0.05, 0.3), draw.uniform(2, 12)
    scene.bodies.append(ROBOTS.cart(draw.uniform(5, 50), rounded(amplitude * frequency)))
    scene.controllers.append(ROBOTS.drive(amplitude, frequency))
    on_top(scene, 0.0, 0.0)
    scene.one_by_one("deck")


def robot(scene):
    """A tree of links with joints of all kinds, native or from a URDF file, falls on a floor and what stands there."""
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    most = 0.0
    for number in range(draw.integer(3, 8)):
        size = flush_size(draw)
        scene.box(size, [round(0.7 * (number % 4), 6), size[1] / 2,
                         round(0.7 * (number // 4), 6)], drawn_motion_level(draw))
        most = max(most, size[1])
    free, urdf = draw.chance(0.5), draw.chance(0.5)
    links = tree_of(draw, free, rounded(most + 0.25))
    if urdf:
        scene.files[f"{scene.name}.urdf"] = ROBOTS.urdf(links, free, seen_from)
        scene.bodies.append(ROBOTS.from_file(f"{scene.name}.urdf", links, free))
    else:
        scene.bodies.append(ROBOTS.native(links))
    scene.among()
    for one in links:
        name = one["name"] if urdf else f"s_{one['name']}"
        scene.pair(name, "p1")
        scene.pair(name, "b*")


def seen_from(place, origin):
    return place if origin is None else [round(a - b, 6) for a, b in zip(place, origin)]


def drawn_motion_level(draw):
    return moving([draw.signed("speed_m_per_s"), 0.0, draw.signed("speed_m_per_s")],
                  [0.0, draw.signed("spin_rad_per_s"), 0.0]) if draw.chance(0.3) else ""


AXES = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}


def tree_of(draw, free, height):
    """Links with their parent, joint, shape and inertia, all in the robot's zero pose, whose axes are the world's. The
    first of a tree with a fixed base hangs on the world."""
    links = []
    for number in range(draw.integer(2, 5)):
        parent = None if number == 0 else links[draw.integer(max(0, number - 2), number - 1)]
        long, thick = draw.uniform(0.15, 0.35), draw.uniform(0.04, 0.1)
        before = parent["anchor"] if parent else [0.0, height, 0.0]
        anchor = [round(before[0] + parent["long"], 6), height, round(before[2], 6)] if parent else before
        ball = draw.chance(0.3)
        radius = rounded(thick * 0.6)
        mass = draw.mass_of(4 / 3 * math.pi * radius**3 if ball else long * thick * thick)
        across = mass / 12 * (long**2 + thick**2)
        inertia = [0.4 * mass * radius**2] * 3 if ball else [mass / 12 * 2 * thick**2, across, across]
        kind = "prismatic" if draw.chance(0.2) else "revolute"
        most = draw.uniform(0.3, 1.5) if kind == "revolute" else draw.uniform(0.05, 0.2)
        one = {"name": f"l{number}", "parent": parent, "anchor": anchor, "long": long, "mass": mass, "kind": kind}
        one |= {"joint": None if parent is None and free else f"j{number}", "limit": most}
        one |= {"ball": radius if ball else 0, "size": [long, thick, thick]}
        one |= {"centre": [round(anchor[0] + long / 2, 6), height, anchor[2]]}
        one |= {"inertia": [rounded(x, 6) for x in inertia]}
        one["axis"] = AXES[draw.one_of("xyz" if kind == "prismatic" else "yzz")]
        one["damping"] = draw.one_of([0.0, 0.0, rounded(0.05 * mass)])
        one["rate"] = draw.uniform(-2, 2) if kind == "revolute" else draw.uniform(-0.3, 0.3)
        links.append(one)
    return links


def cylinders(scene):
    """They roll on their sides, stand, wobble on their rims, fall; balls run into them."""
    draw = scene.draw
    level = draw.chance(0.6)
    slope = [0.0, 1.0, 0.0] if level else [draw.uniform(-0.3, 0.3), 1.0, draw.uniform(-0.3, 0.3)]
    steep = math.sqrt(sum(x * x for x in slope))
    scene.plane([0, 0, 0], slope)
    apart = rounded(1.6 * draw.ranges["size_m"][1])
    for number in range(draw.integer(5, 9)):
        x, z = round((number % 3) * apart, 6), round((number // 3) * apart, 6)
        radius, length = rounded(draw.of("size_m") / 2), draw.of("size_m")
        spin, speed = draw.signed("spin_rad_per_s"), draw.signed("speed_m_per_s")
        manner = draw.one_of(["rolls", "stands", "wobbles", "falls", "ball"] if level else ["falls", "ball"])
        ground = -(slope[0] * x + slope[2] * z)
        if manner == "rolls":
            scene.cylinder(radius, length, [x, radius, z],
                           moving([speed, 0.0, 0.0], [0.0, 0.0, -rounded(speed / radius)]),
                           'quaternion="1.0 1.0 0.0 0.0"')
        elif manner == "stands":
            scene.cylinder(radius, length, [x, length / 2, z], moving([speed, 0.0, 0.0], [0.0, spin, 0.0]))
        elif manner == "ball":
            scene.sphere(radius, [x, rounded(ground + radius * steep + 1e-3, 6), z], drawn_motion(draw))
        else:
            tall = 1.02 * math.sqrt(radius**2 + length**2 / 4) * steep
            turn = f'axis="{text(draw.uniform(-1, 1), 0, 1)}" angle="{text(draw.uniform(0.05, 0.5))}"' \
                if manner == "wobbles" else draw.quaternion()
            motion = moving(None, [0.0, spin, 0.0]) if manner == "wobbles" else drawn_motion(draw)
            scene.cylinder(radius, length, [x, rounded(ground + tall, 6), z], motion, turn)
    scene.pair("b*", "p*")
    round_ones = [line.startswith("<sphere") for line in scene.bodies[1:]]
    for i, ball in enumerate(round_ones):
        for j in range(i):
            if ball or round_ones[j]:
                scene.pair(f"b{i + 1}", f"b{j + 1}")


def rock(draw, radius):
    """Points within a radius of the origin, along all axes and some between."""
    points = []
    for axis in range(3):
        for sign in (-1, 1):
            point = draw.vector(0.5)
            point[axis] += sign
            points.append(point)
    points += [draw.vector(2) for _ in range(draw.integer(0, 6))]
    stretch = [draw.uniform(0.3, 1) for _ in range(3)]
    reach = max(math.hypot(*point) for point in points)
    return [[rounded(x * s * radius / reach) for x, s in zip(point, stretch)] for point in points]


def prism(draw, radius, half):
    """Of three to eight sides, upright: its faces are planes to the last digit."""
    sides, turn = draw.integer(3, 8), draw.uniform(0, 1)
    around = [(turn + 2 * math.pi * k / sides) for k in range(sides)]
    return [[rounded(radius * math.cos(t)), y, rounded(radius * math.sin(t))] for t in around for y in (-half, half)]


SOLIDS = ("hull", "hull", "prism", "capsule", "box", "sphere")
WITH_CYLINDERS = ("cylinder", "cylinder", "cylinder", "disc", "hull", "prism", "capsule", "box", "sphere")


def rocks(scene):
    """Hulls, prisms, capsules, boxes and balls fall in a heap on a floor, or within four walls."""
    heap(scene, SOLIDS)


def heap(scene, kinds):
    draw = scene.draw
    cell = in_cells(scene, 4 + crowd(draw) // 2, grid(2), kinds)
    scene.plane([0, 0, 0], [0, 1, 0])
    if draw.chance(0.5):
        far = rounded(1.1 * cell)
        for x, z in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            scene.plane([x * far, 0, z * far], [-x, 0, -z])
    scene.among()


def scree(scene):
    """The same on a slope, or between two."""
    draw = scene.draw
    tilt, count = draw.of("slope"), draw.integer(5, 10)
    steep = math.sqrt(1 + tilt * tilt)
    scene.plane([0, 0, 0], [tilt, 1, 0])
    if draw.chance(0.5):
        scene.plane([0, 0, 0], [-tilt, 1, 0])
        in_cells(scene, count, lambda n, cell: [0.0, (0.51 * steep + n // 2) * cell, n % 2 * cell], SOLIDS)
    else:
        in_cells(scene, count, lambda n, cell: [n * cell, 0.51 * cell * steep - tilt * n * cell, 0.0], SOLIDS)
    scene.among()


def sticks(scene):
    """Capsules that roll, stand, lie across two others, and fall; balls and boxes among them."""
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    most = draw.ranges["size_m"][1]
    apart, lying, upright = rounded(2.5 * most), 'quaternion="1.0 1.0 0.0 0.0"', ""
    for number in range(draw.integer(4, 7)):
        x, z = round(number % 3 * apart, 6), round(number // 3 * apart, 6)
        radius, length, speed = rounded(draw.of("size_m") / 4), draw.of("size_m"), draw.signed("speed_m_per_s")
        manner = draw.one_of(["rolls", "stands", "across", "falls", "ball", "box"])
        if manner == "rolls":
            spin = -rounded(speed / radius) if draw.chance(0.5) else 0.0
            scene.capsule(radius, length, [x, radius, z], moving([speed, 0.0, 0.0], [0.0, 0.0, spin]), lying)
        elif manner == "stands":
            scene.capsule(radius, length, [x, round(radius + length / 2, 8), z], moving([speed, 0.0, 0.0]), upright)
        elif manner == "across":
            side = rounded(length / 2 + radius)
            for at in (-side, side):
                scene.capsule(radius, length, [round(x + at, 8), radius, z], "", lying)
            scene.capsule(radius, rounded(2.2 * side), [x, 3 * radius, z], drawn_motion_level(draw),
                          'quaternion="1.0 0.0 0.0 1.0"')
        elif manner == "ball":
            scene.sphere(radius, [x, rounded(radius + 1e-3, 6), z], drawn_motion(draw))
        elif manner == "box":
            scene.box([length, 2 * radius, length], [x, radius, z], drawn_motion_level(draw))
        else:
            scene.capsule(radius, length, [x, rounded(1.02 * (radius + length / 2), 6), z], drawn_motion(draw),
                          draw.quaternion())
    scene.among()


def slabs(scene):
    """Prisms flush on each other, one of them kicked, and a capsule that rolls into them."""
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    count, y, radius = draw.integer(3, 6), 0.0, draw.uniform(0.15, 0.3)
    kicked = draw.integer(0, count)
    for number in range(count):
        half = rounded(draw.uniform(0.03, 0.12))
        motion = moving(
            [draw.signed("speed_m_per_s"), 0.0, draw.signed("speed_m_per_s")],
            [0.0, draw.signed("spin_rad_per_s"), 0.0]) if number == kicked else ""
        scene.hull(prism(draw, radius, half), [0.0, round(y + half, 8), 0.0], motion)
        y += 2 * half
    thick, speed = rounded(draw.uniform(0.03, 0.08)), draw.uniform(0.5, 4)
    scene.capsule(thick, draw.uniform(0.1,
                                      0.4), [-rounded(radius + thick + 0.1 * speed), thick,
                                             draw.uniform(-0.1, 0.1)],
                  moving([speed, 0.0, 0.0], [0.0, 0.0, -rounded(speed / thick)]), 'quaternion="1.0 1.0 0.0 0.0"')
    scene.among()


def barrels(scene):
    """Cylinders and discs fall in a heap with all other shapes, as in rocks."""
    heap(scene, WITH_CYLINDERS)


def logs(scene):
    """Two logs between posts and one on top of them, rods across it; a stack of cylinders and boxes, one of them
    kicked; a cylinder that rolls off a step, and a disc that falls on it."""
    draw = scene.draw
    scene.plane([0, 0, 0], [0, 1, 0])
    radius, length, lying = rounded(draw.of("size_m") / 4), draw.of("size_m"), 'quaternion="1.0 1.0 0.0 0.0"'
    for side in (-1, 1):
        scene.cylinder(radius, length, [side * rounded(1.002 * radius), radius, 0.0], "", lying)
        scene.fixed_box([0.1, 3 * radius, length], [side * rounded(2.01 * radius + 0.05, 6), 1.5 * radius, 0.0])
    top = rounded(2.75 * radius)
    scene.cylinder(radius, length, [0.0, top, 0.0], drawn_motion_level(draw), lying)
    scene.capsule(rounded(radius / 2), length, [0.0, rounded(top + 1.51 * radius, 6), 0.0], "",
                  'quaternion="1.0 0.0 0.0 1.0"')
    apart = rounded(3 * draw.ranges["size_m"][1])
    count, y = draw.integer(3, 5), 0.0
    kicked = draw.integer(0, count)
    for number in range(count):
        half, wide = rounded(draw.uniform(0.03, 0.12)), draw.uniform(0.15, 0.3)
        motion = drawn_motion_level(draw) if number == kicked else ""
        if draw.chance(0.7):
            scene.cylinder(wide, 2 * half, [apart, round(y + half, 8), 0.0], motion)
        else:
            scene.box([2 * wide, 2 * half, 1.5 * wide], [apart, round(y + half, 8), 0.0], motion)
        y += 2 * half
    step, speed = draw.uniform(0.1, 0.3), draw.uniform(0.5, 3)
    scene.fixed_box([0.8, step, 0.8], [0.0, step / 2, apart])
    scene.cylinder(radius, length, [0.2, rounded(step + radius, 8), apart],
                   moving([speed, 0.0, 0.0], [0.0, 0.0, -rounded(speed / radius)]), lying)
    scene.disc(rounded(2 * radius), [-0.2, rounded(step + 4.1 * radius, 6), apart], drawn_motion(draw),
               draw.quaternion())
    scene.among()


def tumblers(scene):
    """A few hulls and capsules without gravity fly into each other and into walls."""
    draw = scene.draw
    scene.gravity = [0.0, 0.0, 0.0]
    cell = in_cells(scene, draw.integer(5, 10), grid(2), SOLIDS)
    far = rounded(1.1 * cell)
    for x, z in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        scene.plane([x * far, 0, z * far], [-x, 0, -z])
    scene.plane([0, 0, 0], [0, 1, 0])
    scene.plane([0, rounded(3.1 * cell), 0], [0, -1, 0])
    scene.among()


# Families of the first collection; those with capsules and hulls, which came later, are one of their own, so that the
# numbers of the first mean the scenes that they meant.
FAMILIES = {
    "pile": pile, "bin": in_bin, "stack": stack, "dominoes": dominoes, "wall": wall, "bowl": bowl, "ramp": ramp,
    "corner": corner, "wedge": wedge, "belt": belt, "cart": cart, "robot": robot, "cylinders": cylinders}

SHAPES = {
    "rocks": rocks, "scree": scree, "sticks": sticks, "slabs": slabs, "tumblers": tumblers, "barrels": barrels,
    "logs": logs}


def name_of(seed, number, shapes=False):
    return f"{'s' if shapes else 'r'}{seed}_{number}"


def make(seed, number, shapes=False):
    """The scene of this number: tame and wild by turns, families in the order of FAMILIES, or SHAPES, which are an odd
    number."""
    families = SHAPES if shapes else FAMILIES
    kind, family = KINDS[number % 2], list(families)[number % len(families)]
    scene = Scene(Draw(seed, number, kind, "shapes " if shapes else ""), family, name_of(seed, number, shapes))
    families[family](scene)
    return scene


def write(scene, folder):
    """Writes the scene's files; returns the path of its XML."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in scene.files.items():
        (folder / name).write_text(content)
    path = folder / f"{scene.name}.xml"
    path.write_text(scene.xml())
    return path
