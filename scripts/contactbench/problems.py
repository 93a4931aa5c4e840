"""Contact problems made for the suite, as Siconos text: what, file, how it may end, and what the answer must be."""
import math

FALL = 9.8e-3  # m/s: how fast what stands at first falls after one step, unless it is held


def text(W, q, mu):
    n = len(q)
    lines = ["3", str(n // 3), "0", str(n), str(n), f"{n} {n}"]
    lines += [" ".join(repr(W[i][j]) for i in range(n)) for j in range(n)]  # column by column
    return "\n".join(lines + [" ".join(map(repr, q)), " ".join(map(repr, mu))]) + "\n"


def body(points, velocity, mass=1.0, inertia=1 / 6):
    """A body at the origin that touches level ground in `points`; W and q. Rows n (y up), t1 (x), t2 (-z)."""
    axes = [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)]
    J = []
    for p in points:
        for d in axes:
            cross = (p[1] * d[2] - p[2] * d[1], p[2] * d[0] - p[0] * d[2], p[0] * d[1] - p[1] * d[0])
            J.append(list(d) + list(cross))
    inverse = [1 / mass] * 3 + [1 / inertia] * 3
    W = [[sum(a * m * b for a, m, b in zip(x, inverse, y)) for y in J] for x in J]
    return W, [sum(a * b for a, b in zip(x, velocity)) for x in J]


def arch(ratio, mu=1.0, count=27, radius=10.0):
    """S2: a half circle of `count` voussoirs, its middle line of `radius` m, `ratio` of that thick, on fixed ground;
    from rest, one step's fall. Each joint has two contacts, at its inner and outer edge: normal along the arch, t1
    radial, t2 sideways. Bodies move in the plane, and as points sideways."""
    inner, outer, half = radius * (1 - ratio / 2), radius * (1 + ratio / 2), math.pi / (2 * count)
    centre = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2) * math.sin(half) / half
    mass = (outer**2 - inner**2) * half
    inertia = mass * ((outer**2 + inner**2) / 2 - centre**2)
    inverse = [1 / mass, 1 / mass, 1 / mass, 1 / inertia]  # x, y, z, about z
    J, q = [], []  # rows: body -> x, y, z, about z
    for joint in range(count + 1):
        angle = 2 * half * joint
        out, along = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
        for r in (inner, outer):
            point = (r * out[0], r * out[1])
            for d in ((*along, 0.0), (*out, 0.0), (0.0, 0.0, 1.0)):
                row = {}
                for voussoir, sign in ((joint, 1), (joint - 1, -1)):
                    if 0 <= voussoir < count:
                        middle = (2 * voussoir + 1) * half
                        arm = (point[0] - centre * math.cos(middle), point[1] - centre * math.sin(middle))
                        row[voussoir] = [sign * x for x in (*d, arm[0] * d[1] - arm[1] * d[0])]
                J.append(row)
                q.append(sum(x[1] for x in row.values()) * -FALL)
    W = [[sum(a * m * b for body in x.keys() & y.keys() for a, m, b in zip(x[body], inverse, y[body])) for y in J]
         for x in J]
    return text(W, q, [mu] * (len(q) // 3))


def made():
    """(name, text, ends, largest speed of a contact after the event or None)."""
    fall = [0.1, -0.098, 0.0, 0.0, 0.0, 0.0]
    below = (0.0, -0.5, 0.0)
    W, q = body([below], fall)
    yield "one_contact", text(W, q, [0.5]), ["solved"], None
    yield "one_contact_mu_0", text(W, q, [0.0]), ["solved"], 0.1
    yield "one_contact_mu_1e6", text(W, q, [1e6]), ["solved"], 0.0
    yield "no_contact", "3\n0\n0\n0\n0\n0 0\n\n\n", ["solved", "input_error"], None
    yield "nan", text(W, [math.nan] + q[1:], [0.5]), ["input_error"], None
    yield "1e300", text(W, [-1e300] + q[1:], [0.5]), [
        "solved", "input_error", "not_finite", "singular", "nonconverged", "inaccurate"], None
    yield "both_sides_fixed", text([[0.0] * 3] * 3, [-1.0, 0.0, 0.0], [0.5]), ["input_error"], None
    for count in (2, 16, 100):
        W, q = body([below] * count, fall)
        yield f"repeated_{count}", text(W, q, [0.5] * count), ["solved"], None
    for size in (1e-3, 1e-6, 1e-9):
        points = [(x * size, -0.5, z * size) for x in (-1, 1) for z in (-1, 1)]
        W, q = body(points, fall)
        yield f"patch_of_{size:g}_m", text(W, q, [0.5] * 4), ["solved"], None
    for n in (2, 4, 8, 16):
        points = [(i / (n - 1) - 0.5, -0.5, j / (n - 1) - 0.5) for i in range(n) for j in range(n)]
        W, q = body(points, [0.0, -0.098, 0.0, 0.0, 0.0, 0.0])
        yield f"patch_of_{n * n}_contacts", text(W, q, [0.5] * (n * n)), ["solved"], 0.0

    # W3: two walls that close in on a body of 1 kg from both sides, driven: no velocity of the body satisfies both.
    W = [[0.0] * 6 for _ in range(6)]
    for i in range(3):
        for a, b, sign in ((0, 0, 1), (3, 3, 1), (0, 3, -1), (3, 0, -1)):
            W[a + i][b + i] = float(sign)
    driven = [-1.0, 0.0, 0.0, -1.0, 0.0, 0.0]
    yield "driven_into_a_wall", text(W, driven, [0.3, 0.3]), [
        "ray", "nonconverged", "singular", "cycling", "inaccurate", "input_error", "unsupported"], None

    # F4: three contacts on a circle of 1.5 m under a torque, g = 10: slips above mu m g R = 30 N m. One step of 1 ms.
    h, mass, radius, mu, g = 1e-3, 3.0, 1.5, 2 / 3, 10.0
    inertia = mass * radius * radius / 2
    points = [
        (radius * math.cos(a), 0.0, radius * math.sin(a)) for a in (0.1, 0.1 + 2 * math.pi / 3, 0.1 + 4 * math.pi / 3)]
    for torque, slip in ((29.99, 0.0), (30.01, 0.01 * h / inertia * radius)):
        W, q = body(points, [0.0, -g * h, 0.0, 0.0, torque * h / inertia, 0.0], mass, inertia)
        yield f"triangle_{torque:g}_Nm", text(W, q, [mu] * 3), ["solved"], slip
