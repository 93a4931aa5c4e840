"""An independent look at the files of one run: what it says about penetration, energy, momentum, limits and numbers.

It shares no code with the program (lib/geometry above all): the scene is read from its XML, poses from trajectory.csv,
and depths are separating axes of boxes and hulls (all faces and pairs of edges), the distance of a point to a box, a
cylinder, a capsule or a hull, the least of it along a capsule's axis, and support functions on planes and of cylinders
(the most over the normals of features, and over searches by scans and golden sections). A scene has
plain numbers: no parameters, arrays, harmonics or expressions, and hulls of at most HULL points (those of scenes.py,
and files like them).

What is looked at, each with its bound:
  penetration  at each recorded time, of each pair that can collide: at most PENETRATION of the smaller one's size (its
               largest extent), or what the program itself states, if that is less (`penetration_bound` of the summary's
               options)
  event energy steps.csv's event_energy_gain and the summary's max_gain_relative: at most ENERGY of the energy before
               the event
  energy       of free bodies, from the trajectory alone: contacts take kinetic energy or leave it. With explicit Euler
               the step begins with v + h (g + F/m), so the kinetic energy of an island (what may touch in the step) at
               its end is at most that of these velocities, times 1 + ENERGY, plus the second order of the explicit
               gyroscopic term, h^2 (w x Iw) . I^-1 (w x Iw) / 2
  momentum     a body that touches nothing in a step: dv = h (g + F/m) and dp = h v to MOMENTUM of their size; its
               angular momentum keeps to (h |w|)^2 of itself, which explicit Euler loses in a step
  limits       of joints, as joints.csv has them: kept to LIMIT
  numbers      every cell of every file is finite
Robots: gravity's kick through joints leaves at most the energy of the same kick without them (Gauss), so that the same
law holds for their links, but for the second order of their changing inertia, ROBOT (h w)^2 of their energy. What stops
drive with one steady velocity (a belt) is looked at from that velocity, where they do no work. Motors, and belts of
several rates, are left to the events' own gain.
"""
import csv
import fnmatch
import itertools
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

PENETRATION = 1e-6  # of the smaller size, -
ENERGY = 1e-9  # of the energy before, -
MOMENTUM = 1e-9  # of |v| + h |g| (of |p| + h |v|), -
LIMIT = 1e-8  # rad, m
NEAR_PARALLEL = 1e-8  # |cross product| of unit edges below which it is no axis of its own, -
# Of (h w)^2 and a robot's kinetic energy: what its step gains to second order, w how fast its shape changes, -
ROBOT = 1.0
HULL = 60  # points of a hull: its faces are looked for among all triples
FLAT = 1e-9  # of a hull's extent: as near to a plane are points of a face
CHUNK = 100  # poses at once, of hulls and of cylinders
UNSURE = 0.1 * PENETRATION  # of the smaller size: overlaps of cylinders that are less are not searched for a way out
SCAN = 48  # directions about a line, and
AROUND = 300  # all around, before the best is made better
UPHILL, FINEST = 300, 1e-12  # steps of that at most; a grid, rad, that no step is left on
ALL_WAYS = 720  # off an axis
FLOOR = 1e-20  # of the run's largest kinetic energy: an island with less is at rest, -


def numbers(text, count):
    out = np.array([float(x) for x in text.split()])
    if out.shape != (count, ):
        raise ValueError(f"{count} plain numbers are needed, not '{text}'")
    return out


def matrix(q):
    """Rotation matrices of quaternions w x y z of any length: (..., 4) -> (..., 3, 3)."""
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def turn_of(element):
    if "quaternion" in element.attrib:
        return matrix(numbers(element.get("quaternion"), 4))
    if "axis" in element.attrib:
        axis, angle = numbers(element.get("axis"), 3), float(element.get("angle"))
        return matrix(np.concatenate([[math.cos(angle / 2)], math.sin(angle / 2) * axis / np.linalg.norm(axis)]))
    return np.eye(3)


class Shape:
    """A shape that collides: `owner` is the body or link it belongs to, "" of a fixed one; p, R its pose as the scene
    has it, in a robot's zero pose. half: half of the edges of a box; radius, length of the others; a plane has its
    normal, a hull its points."""
    def __init__(self, kind, name, owner, p, R, half=None, radius=0.0, length=0.0, normal=None, points=None):
        self.kind, self.name, self.owner, self.p, self.R = kind, name, owner, p, R
        self.solid = Solid(points) if kind == "hull" else box_solid(half) if kind == "box" else None
        self.half, self.radius, self.length, self.normal = half, radius, length, normal
        self.bound = {
            "box": lambda: float(np.linalg.norm(half)), "sphere": lambda: radius,
            "cylinder": lambda: math.hypot(radius, length / 2), "capsule": lambda: radius + length / 2,
            "hull": lambda: float(np.linalg.norm(points, axis=1).max()), "half_space": lambda: math.inf}[kind]()
        self.size = {
            "box": lambda: float(2 * max(half)), "sphere": lambda: 2 * radius,
            "cylinder": lambda: max(2 * radius, length), "capsule": lambda: 2 * radius + length,
            "hull": lambda: float(np.ptp(points, axis=0).max()), "half_space": lambda: math.inf}[kind]()


class Solid:
    """A convex polytope: vertices, outward normals with their offsets, loops of faces, edges as pairs of vertices."""
    def __init__(self, points):
        if len(points) > HULL:
            raise ValueError(f"a hull of {len(points)} points; at most {HULL} are read here")
        self.vertices, flat = points, FLAT * np.ptp(points, axis=0).max()
        self.normals, self.offsets, self.loops, edges = [], [], [], set()
        for i, j, k in itertools.combinations(range(len(points)), 3):
            n = np.cross(points[j] - points[i], points[k] - points[i])
            if np.linalg.norm(n) <= flat * np.linalg.norm(points[j] - points[i]):
                continue
            n /= np.linalg.norm(n)
            heights = (points - points[i]) @ n
            if heights.min() >= -flat:
                n, heights = -n, -heights
            if heights.max() > flat or any(abs(n @ m - 1) < 1e-12 for m in self.normals):
                continue
            loop = around(points, np.flatnonzero(heights >= -flat), n)
            self.normals.append(n)
            self.offsets.append(float((points @ n).max()))
            self.loops.append(loop)
            edges |= {(min(e), max(e)) for e in zip(loop, loop[1:] + loop[:1])}
        self.normals, self.offsets = np.array(self.normals), np.array(self.offsets)
        self.edges = np.array(sorted(edges))

    def directions(self):
        """Of the edges, each once."""
        out = []
        for i, j in self.edges:
            e = (self.vertices[j] - self.vertices[i]) / np.linalg.norm(self.vertices[j] - self.vertices[i])
            if not any(np.linalg.norm(np.cross(e, f)) < 1e-9 for f in out):
                out.append(e)
        return np.array(out)

    def moments(self):
        """Volume, centre, and inertia about the centre at density 1: sums over tetrahedra from one of its points."""
        volume, first, second, apex = 0.0, np.zeros(3), np.zeros((3, 3)), self.vertices[0]
        for loop in self.loops:
            a = self.vertices[loop[0]] - apex
            for i, j in zip(loop[1:], loop[2:]):
                b, c = self.vertices[i] - apex, self.vertices[j] - apex
                part, total = float(a @ np.cross(b, c)) / 6, a + b + c
                volume += part
                first += part / 4 * total
                second += part / 20 * (sum(np.outer(x, x) for x in (a, b, c)) + np.outer(total, total))
        second -= np.outer(first, first) / volume
        return volume, apex + first / volume, np.trace(second) * np.eye(3) - second


def around(points, on, n):
    """The corners among the points `on` a plane, counter-clockwise about its normal n: Andrew's monotone chain."""
    u = points[on[1]] - points[on[0]]
    u = u / np.linalg.norm(u)
    flat = np.stack([(points[on] - points[on[0]]) @ u, (points[on] - points[on[0]]) @ np.cross(n, u)], axis=1)
    order, extent = np.lexsort((flat[:, 1], flat[:, 0])), np.ptp(flat, axis=0).max()

    def half(row):
        out = []
        for k in row:  # a point in the middle of a side is no corner
            while len(out) > 1:
                a, b = flat[out[-1]] - flat[out[-2]], flat[k] - flat[out[-2]]
                if a[0] * b[1] - a[1] * b[0] > FLAT * extent * np.linalg.norm(b):
                    break
                out.pop()
            out.append(k)
        return out[:-1]

    return [int(on[k]) for k in half(order) + half(order[::-1])]


def box_solid(half):
    return Solid(np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * half)


def shape_of(element, owner):
    kind, name = element.tag, element.get("name")
    if kind == "half_space":
        normal = numbers(element.get("normal"), 3)
        return Shape(kind, name, "", numbers(element.get("point"), 3), np.eye(3),
                     normal=normal / np.linalg.norm(normal))
    p, R = numbers(element.get("position"), 3), turn_of(element)
    if kind == "box":
        return Shape(kind, name, owner, p, R, half=numbers(element.get("size"), 3) / 2)
    if kind == "hull":
        scale = float(element.get("scale", 1))
        points = np.array([float(x) for x in element.get("points").split()]).reshape(-1, 3)
        return Shape(kind, name, owner, p, R, points=scale * points)
    return Shape(kind, name, owner, p, R, radius=float(element.get("radius")), length=float(element.get("length", 0)))


def inertia_of(shape, mass):
    """Moments about the shape's own axes, homogeneous; of a hull the matrix, in its points' axes."""
    if shape.kind == "hull":
        volume, _, inertia = shape.solid.moments()
        return mass / volume * inertia
    if shape.kind == "capsule":  # a cylinder and a ball, whose halves are off the middle
        r, length = shape.radius, shape.length
        middle = mass * length / (length + 4 / 3 * r)
        ball = mass - middle
        across = middle / 12 * (3 * r**2 + length**2) + ball * (0.4 * r**2 + length**2 / 4 + 3 / 8 * r * length)
        return np.array([across, middle * r**2 / 2 + ball * 0.4 * r**2, across])
    if shape.kind == "box":
        squares = (2 * shape.half)**2
        return mass / 12 * (squares.sum() - squares)
    if shape.kind == "sphere":
        return np.full(3, 0.4 * mass * shape.radius**2)
    across = mass / 12 * (3 * shape.radius**2 + shape.length**2)
    return np.array([across, mass * shape.radius**2 / 2, across])


VOLUME = {
    "box": lambda s: 8 * float(np.prod(s.half)), "sphere": lambda s: 4 / 3 * math.pi * s.radius**3,
    "cylinder": lambda s: math.pi * s.radius**2 * s.length, "capsule": lambda s: math.pi * s.radius**2 *
    (s.length + 4 / 3 * s.radius), "hull": lambda s: s.solid.moments()[0]}


class Model:
    """What a scene's XML says, as far as the look needs it."""
    def __init__(self, path):
        self.path = Path(path)
        root = ET.parse(self.path).getroot()
        self.step, self.duration = float(root.find("simulation").get("step")), float(
            root.find("simulation").get("duration"))
        if root.find("parameters") is not None or root.find("gravity/harmonic") is not None or root.find(
                "bodies/array") is not None:
            raise ValueError(f"{path}: parameters, harmonics and arrays are not read here")
        self.gravity = numbers(root.find("gravity").get("constant"), 3)
        self.shapes, self.free, self.links, self.limits = [], {}, {}, {}
        self.driven = root.find("controllers") is not None or root.find("forces") is not None
        for element in root.find("bodies"):
            if element.tag == "robot":
                self.read_robot(element)
                continue
            fixed = element.tag == "half_space" or element.get("fixed") == "yes"
            shape = shape_of(element, "" if fixed else element.get("name"))
            self.shapes.append(shape)
            if not fixed:
                mass = float(element.get("mass")) if "mass" in element.attrib else float(
                    element.get("density")) * VOLUME[shape.kind](shape)
                self.free[shape.name] = (mass, inertia_of(shape, mass))
        self.pairs = [(p.get("a"), p.get("b"), float(p.get("restitution", 0))) for p in root.iterfind("contacts/pair")]
        self.forces = [(f.get("body"), numbers(f.get("force"), 3), float(f.get("from")), float(f.get("to")))
                       for f in root.iterfind("forces/force")]

    def read_robot(self, robot):
        if any(a in robot.attrib for a in ("position", "axis", "quaternion", "prefix")):
            raise ValueError(f"{self.path}: robots that are placed are not read here")
        if "urdf" in robot.attrib:
            return self.read_urdf(ET.parse(self.path.parent / robot.get("urdf")).getroot())
        for link in robot.iterfind("link"):
            self.links[link.get("name")] = (float(link.get("mass")), numbers(link.get("inertia"), 3))
            self.shapes += [shape_of(shape, link.get("name")) for shape in link]
        for joint in robot.iterfind("joint"):
            if "lower" in joint.attrib:
                self.limits[joint.get("name")] = (float(joint.get("lower")), float(
                    joint.get("upper")), float(joint.get("limit_rate", 0)))
        return None

    def read_urdf(self, root):
        """Origins without turning, one shape a link."""
        parent = {j.find("child").get("link"): j for j in root.iterfind("joint")}

        def at(link):
            joint = parent.get(link)
            return np.zeros(3) if joint is None else at(joint.find("parent").get("link")) + numbers(
                joint.find("origin").get("xyz"), 3)

        for link in root.iterfind("link"):
            name = link.get("name")
            if link.find("inertial") is None:
                continue
            inertia = link.find("inertial/inertia")
            self.links[name] = (float(link.find("inertial/mass").get("value")),
                                np.array([float(inertia.get(i)) for i in ("ixx", "iyy", "izz")]))
            for collision in link.iterfind("collision"):
                origin, solid = collision.find("origin"), collision.find("geometry")[0]
                p = at(name) + numbers(origin.get("xyz"), 3)
                if solid.tag == "box":
                    self.shapes.append(Shape("box", name, name, p, np.eye(3), half=numbers(solid.get("size"), 3) / 2))
                else:
                    self.shapes.append(Shape("sphere", name, name, p, np.eye(3), radius=float(solid.get("radius"))))
        for joint in root.iterfind("joint"):
            limit = joint.find("limit")
            if joint.get("type") in ("revolute", "prismatic") and limit is not None:
                self.limits[joint.get("name")] = (float(limit.get("lower", 0)), float(limit.get("upper", 0)), 0.0)

    def collide(self, a, b):
        """Does a pair of the scene name these two shapes?"""
        if a.owner == b.owner:  # also two fixed ones
            return False
        return any(
            fnmatch.fnmatchcase(a.name, x) and fnmatch.fnmatchcase(b.name, y)
            or fnmatch.fnmatchcase(b.name, x) and fnmatch.fnmatchcase(a.name, y) for x, y, _ in self.pairs)


# ---- signed distances: positive apart (a lower bound of the distance), negative the depth of penetration; K poses at
# once


def box_box(ca, Ra, ha, cb, Rb, hb):
    """Separating axes: faces of both and the cross products of their edges. The depth is the least over the directions,
    along which any of them the boxes could be moved apart."""
    axes = np.concatenate([
        np.swapaxes(Ra, 1, 2),
        np.swapaxes(Rb, 1, 2),
        np.cross(np.swapaxes(Ra, 1, 2)[:, :, None, :],
                 np.swapaxes(Rb, 1, 2)[:, None, :, :]).reshape(-1, 9, 3)], axis=1)
    length = np.linalg.norm(axes, axis=2)
    usable = length > NEAR_PARALLEL
    axes = np.where(usable[:, :, None], axes / np.where(usable, length, 1)[:, :, None], axes[:, :1])
    reach = np.einsum("kaj,kj->ka", np.abs(axes @ Ra), ha) + np.einsum("kaj,kj->ka", np.abs(axes @ Rb), hb)
    return (np.abs(np.einsum("kaj,kj->ka", axes, cb - ca)) - reach).max(axis=1)


def point_box(c, R, half, point):
    """Of a point from a box."""
    q = np.abs(np.einsum("kij,ki->kj", R, point - c)) - half
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


def point_cylinder(c, R, radius, length, point):
    q = np.einsum("kij,ki->kj", R, point - c)
    out = np.stack([np.hypot(q[:, 0], q[:, 2]) - radius, np.abs(q[:, 1]) - length / 2], 1)
    return np.linalg.norm(np.maximum(out, 0), axis=1) + np.minimum(out.max(axis=1), 0)


def point_solid(solid, c, R, point):
    """Of a point from a polytope: over a face, or from the nearest edge."""
    q = np.einsum("kij,ki->kj", R, point - c)
    heights = q @ solid.normals.T - solid.offsets
    best = np.full(len(q), math.inf)
    for i, j in solid.edges:
        a, along = solid.vertices[i], solid.vertices[j] - solid.vertices[i]
        t = np.clip((q - a) @ along / (along @ along), 0, 1)
        best = np.minimum(best, np.linalg.norm(q - a - t[:, None] * along, axis=1))
    for f, loop in enumerate(solid.loops):
        corners = solid.vertices[loop]
        sides = np.cross(np.roll(corners, -1, axis=0) - corners, solid.normals[f])
        over = (np.einsum("sj,ksj->ks", sides, q[:, None, :] - corners) <= 0).all(axis=1) & (heights[:, f] > 0)
        best = np.where(over, np.minimum(best, heights[:, f]), best)
    return np.where(heights.max(axis=1) <= 0, heights.max(axis=1), best)


def point_capsule(c, R, radius, length, point):
    q = np.einsum("kij,ki->kj", R, point - c)
    q[:, 1] -= np.clip(q[:, 1], -length / 2, length / 2)
    return np.linalg.norm(q, axis=1) - radius


def least_along(capsule, p, R, distance):
    """The least of a convex function of points along a capsule's axis, less its radius: by golden sections."""
    half = capsule.length / 2 * R[:, :, 1]

    def at(s):
        return distance(p + s[:, None] * half)

    low, high, part = np.full(len(p), -1.0), np.full(len(p), 1.0), (math.sqrt(5) - 1) / 2
    least = np.minimum(at(low), at(high))
    for _ in range(60):
        left, right = high - part * (high - low), low + part * (high - low)
        f, g = at(left), at(right)
        least = np.minimum(least, np.minimum(f, g))
        low, high = np.where(f < g, low, left), np.where(f < g, right, high)
    return least - capsule.radius


def solid_solid(a, pa, Ra, b, pb, Rb):
    """Separating axes of two polytopes, as box_box: faces of both and all cross products of their edges."""
    edges_a, edges_b = a.directions(), b.directions()
    out = []
    for at in range(0, len(pa), CHUNK):
        p, A, B = (pb - pa)[at:at + CHUNK], Ra[at:at + CHUNK], Rb[at:at + CHUNK]
        faces = [np.einsum("kij,aj->kai", A, a.normals), np.einsum("kij,aj->kai", B, b.normals)]
        u, v = np.einsum("kij,aj->kai", A, edges_a), np.einsum("kij,aj->kai", B, edges_b)
        axes = np.concatenate([*faces, np.cross(u[:, :, None, :], v[:, None, :, :]).reshape(len(p), -1, 3)], axis=1)
        length = np.linalg.norm(axes, axis=2)
        usable = length > NEAR_PARALLEL
        axes = np.where(usable[:, :, None], axes / np.where(usable, length, 1)[:, :, None], axes[:, :1])
        of_a = np.einsum("kai,kvi->kav", axes, np.einsum("kij,vj->kvi", A, a.vertices))
        of_b = np.einsum("kai,kvi->kav", axes, np.einsum("kij,vj->kvi", B, b.vertices) + p[:, None, :])
        gap = np.maximum(of_b.min(axis=2) - of_a.max(axis=2), of_a.min(axis=2) - of_b.max(axis=2))
        out.append(gap.max(axis=1))
    return np.concatenate(out)


def above_plane(plane, shape, p, R):
    """Of a shape's lowest point above a half-space."""
    height = (p - plane.p) @ plane.normal
    n = np.einsum("kij,i->kj", R, plane.normal)
    if shape.kind == "box":
        return height - np.abs(n) @ shape.half
    if shape.kind == "sphere":
        return height - shape.radius
    if shape.kind == "hull":
        return height + (n @ shape.solid.vertices.T).min(axis=1)
    if shape.kind == "capsule":
        return height - shape.length / 2 * np.abs(n[:, 1]) - shape.radius
    return height - shape.length / 2 * np.abs(n[:, 1]) - shape.radius * np.hypot(n[:, 0], n[:, 2])


def support_gap(a, pa, Ra, b, pb, Rb, n):
    """The least of n.x over b less the most of it over a, for unit n (K, N, 3): K x N."""
    return -reach(b, Rb, -n) - reach(a, Ra, n) + np.einsum("kni,ki->kn", n, pb - pa)


def reach(shape, R, n):
    """The most of n.x over a shape about its origin."""
    local = np.einsum("kij,kni->knj", R, n)
    if shape.solid:
        return (local @ shape.solid.vertices.T).max(axis=2)
    along = shape.length / 2 * np.abs(local[..., 1])
    if shape.kind == "capsule":
        return along + shape.radius
    return along + shape.radius * np.hypot(local[..., 0], local[..., 2])


def unit(vectors):
    """Each over its length; what has none is left out by being up."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > NEAR_PARALLEL, vectors / np.where(length > NEAR_PARALLEL, length, 1), np.array([0.0, 1,
                                                                                                             0]))


def lines_of(shape, R):
    """Directions of the edges of a solid, or of an axis: (K, N, 3)."""
    if shape.solid:
        v, e = shape.solid.vertices, shape.solid.edges
        return np.einsum("kij,nj->kni", R, v[e[:, 1]] - v[e[:, 0]])
    return R[:, None, :, 1]


def flat_normals(shape, R):
    """Of faces, of ends."""
    if shape.solid:
        return np.einsum("kij,nj->kni", R, shape.solid.normals)
    return np.stack([R[:, :, 1], -R[:, :, 1]], axis=1) if shape.kind == "cylinder" else np.zeros((len(R), 0, 3))


def first_normals(a, pa, Ra, b, pb, Rb):
    """Directions in which a cylinder a and b may be furthest apart: of flat faces, across the axis and an edge, from
    the axis to each vertex."""
    d = Ra[:, None, :, 1]
    along = lines_of(b, Rb)
    if b.solid:
        corners = pb[:, None, :] + np.einsum("kij,nj->kni", Rb, b.solid.vertices)
    else:
        corners = pb[:, None, :] + np.stack([b.length / 2 * Rb[:, :, 1], -b.length / 2 * Rb[:, :, 1]], axis=1)
    q = corners - pa[:, None, :]
    height = np.einsum("kni,kni->kn", q, np.broadcast_to(d, q.shape))[..., None]
    beside = q - height * d
    rim = beside * (1 - a.radius / np.maximum(np.linalg.norm(beside, axis=2, keepdims=True), a.radius)
                    ) + np.sign(height) * np.maximum(np.abs(height) - a.length / 2, 0) * d
    both = [
        flat_normals(a, Ra),
        flat_normals(b, Rb),
        np.cross(np.broadcast_to(d, along.shape), along), beside, rim,
        q.mean(axis=1, keepdims=True)]
    n = unit(np.concatenate(both, axis=1))
    return np.concatenate([n, -n], axis=1)


def golden_place(value, low, high):
    """Where functions that have one maximum between low and high have it: (..., ) arrays."""
    part = (math.sqrt(5) - 1) / 2
    for _ in range(44):
        left, right = high - part * (high - low), low + part * (high - low)
        lower = value(left) < value(right)
        low, high = np.where(lower, left, low), np.where(lower, high, right)
    return (low + high) / 2


def golden(value, low, high):
    """The most of such functions."""
    return value(golden_place(value, low, high))


def across_lines(a, pa, Ra, b, pb, Rb, lines):
    """The most over normals across each of the lines (K, N, 3): scanned, then by golden sections about the best."""
    e = unit(lines)
    u = unit(np.cross(e, np.where(np.abs(e[..., :1]) < 0.7, np.array([1.0, 0, 0]), np.array([0.0, 0, 1]))))
    v = np.cross(e, u)

    def at(angle):
        return support_gap(a, pa, Ra, b, pb, Rb, np.cos(angle)[..., None] * u + np.sin(angle)[..., None] * v)

    angles = np.arange(SCAN) * (2 * math.pi / SCAN)
    scanned = np.stack([at(np.full(e.shape[:2], angle)) for angle in angles], axis=2)
    best = angles[scanned.argmax(axis=2)]
    return np.maximum(scanned.max(axis=2), golden(at, best - angles[1], best + angles[1])).max(axis=1)


def across_rims(a, pa, Ra, b, pb, Rb, first):
    """The most over all normals, of two cylinders: uphill from the axes, where rims that lean on each other leave a
    way that is but a sliver wide, and from the best of the normals `first` and of those all around.

    On planes of normals of any length the gap times the length has one maximum. Of normals of one length overlaps
    have several."""
    z = 1 - (2 * np.arange(AROUND) + 1) / AROUND
    turn = math.pi * (3 - math.sqrt(5)) * np.arange(AROUND)
    all_around = np.stack([np.sqrt(1 - z * z) * np.cos(turn), z, np.sqrt(1 - z * z) * np.sin(turn)], axis=1)
    n = np.concatenate([first, np.broadcast_to(all_around, (len(pa), AROUND, 3))], axis=1)
    gaps, rows = support_gap(a, pa, Ra, b, pb, Rb, n), np.arange(len(pa))
    best = [n[rows, start] for start in np.argsort(-gaps, axis=1)[:, :4].T]
    axes = [sign * R[:, :, 1] for R in (Ra, Rb) for sign in (1, -1)]
    found = gaps.max(axis=1)
    for m, of_axis in [(m, False) for m in best] + [(m, True) for m in axes]:
        u = unit(np.cross(m, np.where(np.abs(m[:, :1]) < 0.7, np.array([1.0, 0, 0]), np.array([0.0, 0, 1]))))
        plane = np.stack([u, np.cross(m, u)], axis=1)

        def height(there, m=m, plane=plane):
            """Of points (K, N, 2) of the plane."""
            normals = m[:, None, :] + there @ plane
            return support_gap(a, pa, Ra, b, pb, Rb, unit(normals)) * np.linalg.norm(normals, axis=2)

        top = uphill(height, off_axis(height, len(pa)) if of_axis else np.zeros((len(pa), 2)))
        normals = m[:, None, :] + top[:, None, :] @ plane
        found = np.maximum(found, support_gap(a, pa, Ra, b, pb, Rb, unit(normals))[:, 0])
    return found


def off_axis(height, count):
    """Where to begin off the origin, which is the tip of a cone: along the steepest way up, at its highest point."""
    def along(angle, s):
        return height((s * np.stack([np.cos(angle), np.sin(angle)], axis=-1))[:, None, :])[:, 0]

    angles = np.arange(ALL_WAYS) * (2 * math.pi / ALL_WAYS)
    near = np.full((count, 1), 1e-5)
    scanned = np.stack([along(np.full(count, angle), near) for angle in angles], axis=1)
    angle = angles[scanned.argmax(axis=1)]
    angle = golden_place(lambda x: along(x, near), angle - angles[1], angle + angles[1])
    s = golden_place(lambda x: along(angle, x[:, None]), np.zeros(count), np.full(count, 2.0))
    return s[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def uphill(height, best):
    """The highest point near `best` (K, 2), by a grid that is made finer where none of it is higher."""
    grid = np.stack([axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-1, 1, 9)])], axis=1)
    rows, most, width = np.arange(len(best)), height(best[:, None, :])[:, 0], np.full(len(best), 0.3)
    for _ in range(UPHILL):
        there = best[:, None, :] + width[:, None, None] * grid
        heights = height(there)
        at = heights.argmax(axis=1)
        higher = heights[rows, at] > most
        best, most = np.where(higher[:, None], there[rows, at], best), np.where(higher, heights[rows, at], most)
        width = np.where(higher, width, width / 3)
        if width.max() < FINEST:
            break
    return best


def cylinder_apart(a, pa, Ra, b, pb, Rb):
    """Of a cylinder and a box, a hull, a capsule or another cylinder: the most that support functions say, over the
    normals of features, and where these leave too deep an overlap, over searches."""
    out = []
    for at in range(0, len(pa), CHUNK):
        A, B = (pa[at:at + CHUNK], Ra[at:at + CHUNK]), (pb[at:at + CHUNK], Rb[at:at + CHUNK])
        both = [((a, *A), (b, *B)), ((b, *B), (a, *A))]
        n = np.concatenate([first_normals(*one, *other) for one, other in both if one[0].kind == "cylinder"], axis=1)
        gap = support_gap(a, *A, b, *B, n).max(axis=1)
        close = np.flatnonzero(gap < -UNSURE * min(a.size, b.size))
        if len(close):
            A, B = (A[0][close], A[1][close]), (B[0][close], B[1][close])
            searched = across_lines(a, *A, b, *B, lines_of(b, B[1]))
            if b.kind == "cylinder":
                searched = np.maximum(searched, across_lines(a, *A, b, *B, lines_of(a, A[1])))
                searched = np.maximum(searched, across_rims(a, *A, b, *B, n[close]))
            gap[close] = np.maximum(gap[close], searched)
        out.append(gap)
    return np.concatenate(out) if out else np.zeros(0)


def apart(a, pa, Ra, b, pb, Rb):
    """Signed distance of two shapes at K poses."""
    if a.kind == "half_space" or b.kind == "half_space":
        return above_plane(a, b, pb, Rb) if a.kind == "half_space" else above_plane(b, a, pa, Ra)
    if a.kind == "sphere" and b.kind == "sphere":
        return np.linalg.norm(pa - pb, axis=1) - a.radius - b.radius
    if a.kind == "box" and b.kind == "box":
        k = len(pa)
        return box_box(pa, Ra, np.broadcast_to(a.half, (k, 3)), pb, Rb, np.broadcast_to(b.half, (k, 3)))
    if a.solid and b.solid:
        return solid_solid(a.solid, pa, Ra, b.solid, pb, Rb)
    rounds = ("sphere", "capsule")
    if b.kind not in rounds or b.kind == "sphere" and a.kind == "capsule":
        a, pa, Ra, b, pb, Rb = b, pb, Rb, a, pa, Ra
    if "cylinder" in (a.kind, b.kind) and "sphere" not in (a.kind, b.kind):
        if a.kind != "cylinder":
            a, pa, Ra, b, pb, Rb = b, pb, Rb, a, pa, Ra
        return cylinder_apart(a, pa, Ra, b, pb, Rb)

    def distance(point):
        if a.kind == "box":
            return point_box(pa, Ra, a.half, point)
        if a.kind == "hull":
            return point_solid(a.solid, pa, Ra, point)
        if a.kind == "cylinder":
            return point_cylinder(pa, Ra, a.radius, a.length, point)
        return point_capsule(pa, Ra, a.radius, a.length, point)

    return least_along(b, pb, Rb, distance) if b.kind == "capsule" else distance(pb) - b.radius


def initial_penetration(model):
    """Deepest penetration of a scene as it is written, over the smaller size."""
    worst = 0.0
    for i, a in enumerate(model.shapes):
        for b in model.shapes[:i]:
            if model.collide(a, b):
                gap = apart(a, a.p[None], a.R[None], b, b.p[None], b.R[None])
                worst = max(worst, -float(gap[0]) / min(a.size, b.size))
    return worst


# ---- files of a run


class Damaged(Exception):
    """A file that is not what it should be."""


def trajectory(path):
    """Times (T), and for each body p (T, 3), q (T, 4), v (T, 3), w (T, 3)."""
    lines = path.read_text().split("\n")
    if lines[0] != "t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz" or lines[-1] != "":
        raise Damaged("trajectory.csv has no whole rows")
    rows = [line.split(",") for line in lines[1:-1]]
    names = []
    for row in rows:
        if row[1] in names[:1]:
            break
        names.append(row[1])
    if not names or len(rows) % len(names) or any(row[1] != names[i % len(names)] for i, row in enumerate(rows)):
        raise Damaged("trajectory.csv has not every body at every time")
    try:
        table = np.array([[row[0], *row[2:]] for row in rows], dtype=float)
    except ValueError as error:
        raise Damaged(f"trajectory.csv: {error}") from None
    if not np.isfinite(table).all():
        raise Damaged("trajectory.csv holds NaN or infinity")
    table = table.reshape(-1, len(names), 14)
    return table[:, 0, 0], {
        name: (table[:, i, 1:4], table[:, i, 4:8], table[:, i, 8:11], table[:, i, 11:14])
        for i, name in enumerate(names)}


def rows_of(path):
    """Rows of a CSV file; each number is finite, or not there."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name, cell in row.items():
            try:
                finite = cell == "" or math.isfinite(float(cell))
            except (ValueError, TypeError):
                finite = cell is not None and name in ("status", "joint", "a", "b")
            if not finite:
                raise Damaged(f"{path.name}: {name} is {cell!r}")
    return rows


class Look:
    """What was found: numbers, and `faults`, one line for each bound that is missed."""
    def __init__(self):
        self.faults = []
        self.penetration, self.penetration_relative, self.where = 0.0, 0.0, ""
        self.energy_gain, self.event_gain, self.momentum = 0.0, 0.0, 0.0


def look(folder, model, summary):
    out, folder = Look(), Path(folder)
    try:
        times, motion = trajectory(folder / "trajectory.csv")
        steps = rows_of(folder / "steps.csv")
        joints = rows_of(folder / "joints.csv") if model.limits else []
        for name in ("loads.csv", ):
            if (folder / name).exists():
                rows_of(folder / name)
    except (Damaged, OSError) as error:
        out.faults.append(f"files: {error}")
        return out
    if set(motion) != set(model.free) | set(model.links):
        out.faults.append("files: trajectory.csv has other bodies than the scene")
        return out
    if summary["status"] in ("ok", "inaccurate") and abs(times[-1] - model.duration) > model.step:
        out.faults.append(f"files: the trajectory ends at {times[-1]:g} s, not {model.duration:g} s")
    take_frames(model, motion, out)
    touches = penetrations(model, times, motion, summary, out)
    energy(model, times, motion, summary, steps, touches, out)
    momentum(model, times, motion, touches, out)
    for row in joints:
        if row["joint"] in model.limits:
            lower, upper, rate = model.limits[row["joint"]]
            q, moved = float(row["q"]), rate * float(row["t"])
            beyond = max(lower + moved - q, q - upper - moved)
            if beyond > LIMIT:
                out.faults.append(f"limits: {row['joint']} is {beyond:.3g} beyond its limit at t = {row['t']} s")
                break
    return out


def take_frames(model, motion, out):
    """Moments of free hulls about the axes of their bodies, which have to be principal and about the centre of mass."""
    for shape in model.shapes:
        if shape.kind != "hull" or shape.owner not in model.free:
            continue
        p, q, _, _ = motion[shape.owner]
        mass, turn = model.free[shape.owner][0], matrix(q)[0].T @ shape.R
        inertia = turn @ inertia_of(shape, mass) @ turn.T
        centre = shape.p + shape.R @ shape.solid.moments()[1]
        off = np.abs(inertia - np.diag(np.diag(inertia))).max() / np.diag(inertia).max()
        if off > 1e-9 or np.linalg.norm(centre - p[0]) > 1e-9 * shape.size:
            out.faults.append(f"files: the frame of {shape.name} is not that of its centre and principal axes")
        model.free[shape.owner] = (mass, np.diag(inertia))


def poses(model, motion):
    """Of each shape: p (T, 3), R (T, 3, 3), v (T, 3), w (T, 3), or one of a fixed one, repeated."""
    count = len(next(iter(motion.values()))[0])
    out = []
    for shape in model.shapes:
        if shape.owner == "":
            still = np.zeros((count, 3))
            out.append((np.broadcast_to(shape.p, (count, 3)), np.broadcast_to(shape.R, (count, 3, 3)), still, still))
            continue
        p, q, v, w = motion[shape.owner]
        R = matrix(q)
        if shape.owner in model.links or shape.kind == "hull":
            # A robot starts in its zero pose, a hull where the scene has its points, whatever the body's own frame is.
            arm = R[0].T @ (shape.p - p[0])
            out.append((p + R @ arm, R @ (R[0].T @ shape.R), v, w))
        else:
            out.append((p, R, v, w))
    return out


def travels(model, at):
    """How far a point of each shape can get in the step before or after each time, m."""
    h, out = model.step, []
    for shape, (_, _, v, w) in zip(model.shapes, at):
        reach = (shape.bound
                 if math.isfinite(shape.bound) else 0.0) + np.linalg.norm(shape.p) * (shape.owner in model.links)
        speed = np.linalg.norm(v, axis=1) + reach * np.linalg.norm(w, axis=1)
        speed[:-1] = np.maximum(speed[:-1], speed[1:])
        out.append(h * (speed + (np.linalg.norm(model.gravity) * h if shape.owner else 0)))
    return out


def close_times(a, pa, b, pb, margin):
    """Indices of the times at which spheres around the two come closer than the margin."""
    if "half_space" in (a.kind, b.kind):
        plane, other, p = (a, b, pb) if a.kind == "half_space" else (b, a, pa)
        return np.flatnonzero((p - plane.p) @ plane.normal - other.bound < margin)
    return np.flatnonzero(np.linalg.norm(pa - pb, axis=1) - a.bound - b.bound < margin)


def penetrations(model, times, motion, summary, out):
    """Fills in the worst penetration. Returns which owners may touch in the step from each time: [(owner, owner, (T -
    1) bool)]."""
    at = poses(model, motion)
    travel, touches = travels(model, at), []
    for i, a in enumerate(model.shapes):
        for j in range(i):
            b = model.shapes[j]
            if not model.collide(a, b):
                continue
            (pa, Ra, _, _), (pb, Rb, _, _) = at[i], at[j]
            margin = 2 * (travel[i] + travel[j]) + PENETRATION * min(a.size, b.size)
            near = close_times(a, pa, b, pb, margin)
            if len(near) == 0:
                continue
            gap = apart(a, pa[near], Ra[near], b, pb[near], Rb[near])
            touching = np.zeros(len(times), bool)
            touching[near[gap < margin[near]]] = True
            touches.append((a.owner, b.owner, touching[:-1] | touching[1:]))
            deepest = int(np.argmin(gap))
            depth, size = -float(gap[deepest]), min(a.size, b.size)
            if depth / size > out.penetration_relative:
                out.penetration, out.penetration_relative = depth, depth / size
                out.where = f"{b.name} and {a.name} at t = {times[near[deepest]]:g} s"
    bound = min(PENETRATION, (summary.get("options") or {}).get("penetration_bound", PENETRATION))
    if out.penetration_relative > bound:
        out.faults.append(
            f"penetration: {out.penetration:.3g} m, {out.penetration_relative:.3g} of the size, {out.where}")
    return touches


def islands(names, model, touches, steps):
    """For each step, a number for each of the names: the same where bodies may touch, one by way of another. A robot's
    links are one."""
    index = {name: k for k, name in enumerate(names)}
    for name in model.links:
        if name in index:
            index[name] = index[next(iter(model.links))]
    label = np.tile(np.arange(len(names)), (steps, 1))
    label[:, [k for k, name in enumerate(names) if index[name] != k]] = index.get(next(iter(model.links), ""), 0)
    edges = [
        (index[a], index[b], touching) for a, b, touching in touches if a in index and b in index and touching.any()]
    changed = True
    while changed:
        changed = False
        for a, b, touching in edges:
            least = np.minimum(label[:, a], label[:, b])
            if (touching & ((label[:, a] != least) | (label[:, b] != least))).any():
                label[touching, a] = label[touching, b] = least[touching]
                changed = True
    root = [index[name] for name in names]
    return label[:, root]


def push(model, name, mass, times):
    """Acceleration of a free body in the step from each time: gravity and forces."""
    a = np.broadcast_to(model.gravity, (len(times) - 1, 3)).copy()
    for body, force, start, stop in model.forces:
        if body == name:
            a[(times[:-1] > start - model.step * 1e-6) & (times[:-1] < stop - model.step * 1e-6)] += force / mass
    return a


def moving_frame(model, motion):
    """The one steady velocity of all links, where stops drive them: seen from there, they do no work. None where there
    is none."""
    v = np.concatenate([motion[name][2] for name in model.links])
    w = np.concatenate([motion[name][3] for name in model.links])
    steady = not model.driven and np.ptp(v, axis=0).max() <= MOMENTUM * np.abs(v).max() and not w.any()
    return v[0] if steady else None


def fastest(model, motion):
    """How fast a robot changes its shape at each time, rad/s: turns of its links, and their speeds over their size."""
    size = min(shape.size for shape in model.shapes if shape.owner in model.links)
    return sum(
        np.linalg.norm(motion[name][3], axis=1) + np.linalg.norm(motion[name][2], axis=1) / size
        for name in model.links)


def compare_steps(steps, kinetic, out):
    """Has steps.csv the kinetic energy that the trajectory has?"""
    for row, k in zip(steps, kinetic[1:]):
        if abs(float(row["kinetic_energy"]) - k) > 1e-6 * max(k, 1e-12 * kinetic.max()):
            out.faults.append(
                f"energy: steps.csv has {row['kinetic_energy']} J at t = {row['t']} s, the trajectory {k:.9g} J")
            break


def energy(model, times, motion, summary, steps, touches, out):
    gains = summary.get("energy") or {}
    out.event_gain = max(0.0, gains.get("max_gain_relative") or 0.0)
    driven = any(rate for _, _, rate in model.limits.values())  # the stops do work in the events
    if out.event_gain > ENERGY and not driven:
        out.faults.append(
            f"energy: an event gains {out.event_gain:.3g} of its kinetic energy ({gains.get('max_gain_j')} J)")
    frame, counted = np.zeros(3), {**model.free, **model.links}
    if model.links and (driven or model.driven):
        frame, counted = moving_frame(model, motion), model.free
        if frame is None or not counted:
            return
    kinetic, begun = energies(model, times, motion, counted, frame)
    if not frame.any() and not model.links:
        compare_steps(steps, kinetic.sum(axis=1), out)
    # Island by island, so that what is heavy and fast elsewhere hides nothing.
    label = islands(list(counted), model, touches, len(times) - 1)
    floor = FLOOR * max(kinetic.sum(axis=1).max(), begun.sum(axis=1).max(initial=0), 1e-300)
    for number in range(label.shape[1]):
        member = label == number
        before, after = (begun * member).sum(axis=1), (kinetic[1:] * member).sum(axis=1)
        gain = (after - before) / np.maximum(before, floor)
        worst = int(np.argmax(gain)) if len(gain) else 0
        if len(gain) and gain[worst] > out.energy_gain:
            out.energy_gain = float(gain[worst])
            where = f"the island of {list(counted)[number]} in the step to t = {times[worst + 1]:g} s"
    if out.energy_gain > ENERGY:
        out.faults.append(f"energy: kinetic energy gains {out.energy_gain:.3g} of itself, {where}")


def energies(model, times, motion, counted, frame):
    """Kinetic energy of each body at each time (T, bodies), and the most that each step may begin with (T - 1,
    bodies)."""
    h, kinetic, begun = model.step, [], []
    for name, (mass, inertia) in counted.items():
        _, q, v, w = motion[name]
        v, R = v - frame, matrix(q)
        spin = np.einsum("kij,ki->kj", R @ R[0].T if name in model.links else R, w)
        turning = 0.5 * (spin**2) @ inertia
        own = 0.5 * mass * (v**2).sum(axis=1) + turning
        pushed = v[:-1] + h * push(model, name, mass, times)
        torque = np.cross(spin, spin * inertia)[:-1]
        rounded = np.spacing(np.abs(v[:-1]) + np.abs(pushed))  # a velocity that all but vanishes is a small difference
        most = 0.5 * mass * ((np.abs(pushed) + rounded)**2).sum(axis=1) + turning[:-1]
        most = most + 0.5 * h * h * (torque**2 / inertia).sum(axis=1)
        if name in model.links:
            most = most + ROBOT * (h * fastest(model, motion)[:-1])**2 * own[:-1]
        kinetic.append(own)
        begun.append(most)
    return np.stack(kinetic, 1), np.stack(begun, 1)


def momentum(model, times, motion, touches, out):
    h = model.step
    for name, (mass, inertia) in model.free.items():
        own = [touching for a, b, touching in touches if name in (a, b)]
        free = ~np.any([np.zeros(len(times) - 1, bool), *own], axis=0)
        if not free.any():
            continue
        p, q, v, w = motion[name]
        pushed = push(model, name, mass, times)
        size_v = np.linalg.norm(v[:-1], axis=1) + h * np.linalg.norm(pushed, axis=1)
        size_p = np.linalg.norm(p[:-1], axis=1) + h * np.linalg.norm(v[1:], axis=1)
        R = matrix(q)
        L = np.einsum("kij,kj->ki", R, inertia * np.einsum("kij,ki->kj", R, w))
        second_order = (h * np.linalg.norm(w[:-1], axis=1))**2 * inertia.max() / inertia.min() + MOMENTUM
        for what, error, allowed in (("velocity", np.linalg.norm(
                v[1:] - v[:-1] - h * pushed,
                axis=1), MOMENTUM * size_v), ("place", np.linalg.norm(
                    p[1:] - p[:-1] - h * v[1:],
                    axis=1), MOMENTUM * size_p), ("angular momentum", np.linalg.norm(
                        L[1:] - L[:-1], axis=1), second_order * np.linalg.norm(L[:-1], axis=1))):
            ratio = np.where(free, error / np.maximum(allowed, 1e-300), 0.0)
            ratio[(error == 0)] = 0.0
            worst = int(np.argmax(ratio))
            out.momentum = max(out.momentum, float(ratio[worst]))
            if ratio[worst] > 1:
                off = f"its {what} is off by {error[worst]:.3g} at t = {times[worst + 1]:g} s"
                out.faults.append(f"momentum: {name} touches nothing, and {off}")
                return
