"""A motion as binary glTF 2.0 (Khronos, 2017): a node a body, animated, a node a shape below it; y is up, metres."""
import json
import math
import struct

import numpy as np

FLOAT, UINT = 5126, 5125
VERTICES, INDICES = 34962, 34963  # targets of buffer views
AROUND, DOWN = 32, 16  # facets of round shapes
GREY, COLOURS = (0.6, 0.6, 0.6), ((0.30, 0.55, 0.75), (0.85, 0.60, 0.30), (0.45, 0.65, 0.45), (0.70, 0.50, 0.65))


def patch(corner, count_a=1, count_b=1):
    """Points corner(i/count_a, j/count_b) of a surface with their normals, as (points, normals, triangles)."""
    points = [corner(i / count_a, j / count_b) for i in range(count_a + 1) for j in range(count_b + 1)]
    wide = count_b + 1
    triangles = []
    for i in range(count_a):
        for j in range(count_b):
            p = i * wide + j
            triangles += [(p, p + 1, p + wide + 1), (p, p + wide + 1, p + wide)]
    return [p for p, _ in points], [n for _, n in points], triangles


def box(h):
    faces = []
    for axis in range(3):
        for sign in (1, -1):
            n, u, v = (np.roll(e, axis) for e in np.eye(3))
            u = sign * u
            faces.append(patch(lambda i, j, n=sign * n, u=u, v=v: (h * (n + (2 * i - 1) * v + (2 * j - 1) * u), n)))
    return joined(faces)


def sphere(radius):
    def at(i, j):
        up, turn = math.pi * i, 2 * math.pi * j
        n = np.array([math.sin(up) * math.cos(turn), math.cos(up), math.sin(up) * math.sin(turn)])
        return radius * n, n

    return patch(at, DOWN, AROUND)


def cylinder(radius, half):
    def rim(j):
        turn = 2 * math.pi * j
        return np.array([math.cos(turn), 0, math.sin(turn)])

    y = np.array([0.0, 1, 0])
    side = patch(lambda i, j: (radius * rim(j) + (1 - 2 * i) * half * y, rim(j)), 1, AROUND)
    top = patch(lambda i, j: (i * radius * rim(j) + half * y, y), 1, AROUND)
    under = patch(lambda i, j: (i * radius * rim(-j) - half * y, -y), 1, AROUND)
    return joined([side, top, under])


def capsule(radius, half):
    def at(i, j):
        n = np.array([math.sin(i) * math.cos(2 * math.pi * j), math.cos(i), math.sin(i) * math.sin(2 * math.pi * j)])
        return radius * n + np.array([0, half if n[1] > 0 else -half, 0]), n

    quarter = math.pi / 2 * (1 - 1e-9)  # the rims belong to the ends that they are on
    side = patch(lambda i, j: at(quarter if i == 0 else math.pi - quarter, j), 1, AROUND)
    return joined([
        patch(lambda i, j: at(i * quarter, j), DOWN // 2, AROUND), side,
        patch(lambda i, j: at(math.pi - (1 - i) * quarter, j), DOWN // 2, AROUND)])


def hull(faces):
    parts = []
    for corners in map(np.array, faces):
        n = sum(np.cross(b - corners[0], c - corners[0]) for b, c in zip(corners[1:], corners[2:]))
        fan = [(0, k, k + 1) for k in range(1, len(corners) - 1)]
        parts.append((list(corners), [n / np.linalg.norm(n)] * len(corners), fan))
    return joined(parts)


def plane(size):
    y = np.array([0.0, 1, 0])
    return patch(lambda i, j: (size * np.array([2 * i - 1, 0, 2 * j - 1]), y))


def joined(parts):
    points, normals, triangles = [], [], []
    for p, n, t in parts:
        triangles += [tuple(i + len(points) for i in one) for one in t]
        points += p
        normals += n
    return points, normals, triangles


def mesh_of(shape, extent):
    """The surface of a row of view.Motion.surfaces. `extent`: how far the ground is drawn, m."""
    if shape["kind"] == "box":
        return box(np.array([shape["hx"], shape["hy"], shape["hz"]]))
    if shape["kind"] == "sphere":
        return sphere(shape["radius"])
    if shape["kind"] == "capsule":
        return capsule(shape["radius"], shape["hy"])
    if shape["kind"] == "hull":
        return hull(shape["faces"])
    return cylinder(shape["radius"], shape["hy"]) if shape["kind"] == "cylinder" else plane(extent)


class Buffer:
    """The binary chunk with its views and accessors."""
    def __init__(self):
        self.data, self.views, self.accessors = b"", [], []

    def add(self, values, kind, form, target=None, bounds=False):
        values = np.asarray(values, dtype="<f4" if kind == FLOAT else "<u4")
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes}
        self.views.append(view | ({"target": target} if target else {}))
        accessor = {"bufferView": len(self.views) - 1, "componentType": kind, "type": form, "count": len(values)}
        if bounds:
            rows = values.reshape(len(values), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        self.data += values.tobytes()
        return len(self.accessors) - 1


def pose(row):
    q = [float(row[k]) for k in ("qx", "qy", "qz", "qw")]
    size = math.hypot(*q)
    return {"translation": [float(row[k]) for k in ("px", "py", "pz")], "rotation": [x / size for x in q]}


def file_of(motion):
    """The bytes of a .glb file of a view.Motion."""
    buffer, meshes, nodes, roots = Buffer(), [], [], []
    extent = 2 + 2 * float(np.abs(motion.poses[..., :3]).max())
    of_body = {}
    for body, place in zip(motion.bodies, motion.poses[0]):
        of_body[body] = len(nodes)
        roots.append(len(nodes))
        nodes.append({"name": body, "children": []} |
                     pose(dict(zip(("px", "py", "pz", "qx", "qy", "qz", "qw"), place))))
    for shape in motion.surfaces():
        points, normals, triangles = mesh_of(shape, extent)
        moves = shape["body"] in of_body
        material = 1 + of_body[shape["body"]] % len(COLOURS) if moves else 0
        part = {
            "attributes": {
                "POSITION": buffer.add(points, FLOAT, "VEC3", VERTICES, bounds=True), "NORMAL": buffer.add(
                    normals, FLOAT, "VEC3", VERTICES)}, "indices": buffer.add(np.ravel(triangles), UINT, "SCALAR",
                                                                              INDICES), "material": material}
        meshes.append({"name": shape["shape"], "primitives": [part]})
        (nodes[of_body[shape["body"]]]["children"] if moves else roots).append(len(nodes))
        nodes.append({"name": shape["shape"], "mesh": len(meshes) - 1} | pose(shape))
    for node in nodes:
        if node.get("children") == []:
            del node["children"]
    channels, samplers = [], []
    times = buffer.add(motion.t, FLOAT, "SCALAR", bounds=True)
    for number, body in enumerate(motion.bodies):
        q = motion.poses[:, number, 3:7] / np.linalg.norm(motion.poses[:, number, 3:7], axis=1, keepdims=True)
        for path, form, values in (("translation", "VEC3", motion.poses[:, number, :3]), ("rotation", "VEC4", q)):
            channels.append({"sampler": len(samplers), "target": {"node": of_body[body], "path": path}})
            samplers.append({"input": times, "output": buffer.add(values, FLOAT, form), "interpolation": "LINEAR"})
    materials = [{
        "pbrMetallicRoughness": {"baseColorFactor": [*c, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}}
                 for c in (GREY, *COLOURS)]
    document = {
        "asset": {"version": "2.0", "generator": "contactbench"}, "scene": 0, "scenes": [{
            "name": motion.scene, "nodes": roots}], "nodes": nodes, "meshes": meshes, "materials": materials,
        "animations": [{"name": motion.label, "channels": channels, "samplers": samplers}], "buffers": [{
            "byteLength": len(buffer.data)}], "bufferViews": buffer.views, "accessors": buffer.accessors}
    text = json.dumps(document).encode()
    chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", buffer.data + b"\0" * (-len(buffer.data) % 4))]
    body = b"".join(struct.pack("<I", len(data)) + kind + data for kind, data in chunks)
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body
