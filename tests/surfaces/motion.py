#!/usr/bin/env python3
"""Measures how levels move: RMS distances to their source under skins, animations and morph targets.

Reads and poses files by itself (numpy), and asks libigl for nearest points; nothing of the project's
own evaluator is in it. Each pose's figure is the two-sided RMS distance of the posed surfaces, over the
diagonal of the posed source (or over --length). Poses:

- the nodes as they stand, if there is a skin;
- every animation at some times;
- without animations of a skin, every joint turned by 0.4 about an axis of its own;
- every morph target at weight 1; with it how much of the largest delta is left (`peak`).

    motion.py SOURCE LEVEL... [--length L]

prints one row a level: RMS at rest, over all poses of the skin, over all targets, the least peak. Needs what
the peers need (see ../peers/setting.py).
"""

import argparse
import json
import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "peers"))

import setting

setting.enter_environment()

import igl
import numpy as np

KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
SAMPLES, TIMES, TURN = 20_000, 4, 0.4


class File:
    """A self-contained .glb."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[28 + length :]

    def view(self, index, kind, width, count, offset=0):
        view = self.json["bufferViews"][index]
        size = np.dtype(kind).itemsize * width
        start = view.get("byteOffset", 0) + offset
        stride = view.get("byteStride", size)
        rows = np.ndarray((count, width), kind, self.binary, start, (stride, np.dtype(kind).itemsize))
        return rows.copy()

    def rows(self, index):
        """An accessor's elements as doubles, sparse ones filled in, normalized ones in -1...1."""
        a = self.json["accessors"][index]
        kind, width, count = KINDS[a["componentType"]], WIDTHS[a["type"]], a["count"]
        if "bufferView" in a:
            rows = self.view(a["bufferView"], kind, width, count, a.get("byteOffset", 0))
        else:
            rows = np.zeros((count, width), kind)
        if "sparse" in a:
            s = a["sparse"]
            at, to = s["indices"], s["values"]
            places = self.view(at["bufferView"], KINDS[at["componentType"]], 1, s["count"],
                               at.get("byteOffset", 0))
            rows[places[:, 0]] = self.view(to["bufferView"], kind, width, s["count"],
                                           to.get("byteOffset", 0))
        rows = rows.astype(np.float64)
        if a.get("normalized"):
            rows = np.maximum(rows / np.iinfo(kind).max, -1)
        return rows

    def nodes(self):
        return self.json.get("nodes", [])

    def mesh_nodes(self):
        return [n for n in self.nodes() if "mesh" in n]

    def locals(self):
        """Translation, rotation and scale of each node, or its matrix."""
        return [
            {"t": np.array(n.get("translation", [0, 0, 0]), float),
             "r": np.array(n.get("rotation", [0, 0, 0, 1]), float),
             "s": np.array(n.get("scale", [1, 1, 1]), float),
             "m": np.array(n["matrix"], float).reshape(4, 4).T if "matrix" in n else None}
            for n in self.nodes()
        ]

    def worlds(self, locals):
        worlds = [None] * len(locals)
        def visit(index, parent):
            worlds[index] = parent @ matrix(locals[index])
            for child in self.nodes()[index].get("children", []):
                visit(child, worlds[index])
        children = {c for n in self.nodes() for c in n.get("children", [])}
        for root in set(range(len(locals))) - children:
            visit(root, np.eye(4))
        return worlds

    def animated(self, animation, share):
        locals = self.locals()
        samplers = animation["samplers"]
        end = max(self.rows(s["input"]).max() for s in samplers)
        for channel in animation["channels"]:
            sampler, target = samplers[channel["sampler"]], channel["target"]
            key = {"translation": "t", "rotation": "r", "scale": "s"}.get(target.get("path"))
            if key is None or "node" not in target:
                continue
            times, values = self.rows(sampler["input"])[:, 0], self.rows(sampler["output"])
            if sampler.get("interpolation") == "CUBICSPLINE":
                values = values[1::3]
            at = np.clip(np.searchsorted(times, share * end), 1, max(len(times) - 1, 1))
            if len(times) == 1:
                locals[target["node"]][key] = values[0]
                continue
            f = np.clip((share * end - times[at - 1]) / (times[at] - times[at - 1]), 0, 1)
            a, b = values[at - 1], values[at]
            if key == "r" and a @ b < 0:
                b = -b
            locals[target["node"]][key] = (1 - f) * a + f * b
        return locals

    def turned(self):
        locals = self.locals()
        for joint in {j for s in self.json.get("skins", []) for j in s["joints"]}:
            axis = np.array([np.sin(joint), np.cos(1.7 * joint), np.sin(0.6 * joint)])
            axis /= np.linalg.norm(axis)
            local = locals[joint]
            local["r"] = quaternion(local["r"], np.append(np.sin(TURN / 2) * axis, np.cos(TURN / 2)))
        return locals

    def surface(self, locals=None, target=None):
        """Positions and triangles of the scene, posed by nodes if given, with one target at 1."""
        worlds = self.worlds(self.locals() if locals is None else locals)
        positions, triangles, first = [], [], 0
        for node in self.mesh_nodes():
            index = self.nodes().index(node)
            for primitive in self.json["meshes"][node["mesh"]]["primitives"]:
                if primitive.get("mode", 4) != 4:
                    continue
                p = self.rows(primitive["attributes"]["POSITION"])
                targets = primitive.get("targets", [])
                if target is not None and target < len(targets) and "POSITION" in targets[target]:
                    p = p + self.rows(targets[target]["POSITION"])
                if "skin" in node and locals is not None:
                    p = self.skinned(node["skin"], primitive, p, worlds)
                elif "skin" not in node:
                    p = p @ worlds[index][:3, :3].T + worlds[index][:3, 3]
                t = (self.rows(primitive["indices"]).astype(np.int64).reshape(-1, 3)
                     if "indices" in primitive else np.arange(len(p)).reshape(-1, 3))
                positions.append(p)
                triangles.append(t + first)
                first += len(p)
        return np.concatenate(positions), np.concatenate(triangles)

    def skinned(self, skin, primitive, p, worlds):
        skin = self.json["skins"][skin]
        binds = (self.rows(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
                 if "inverseBindMatrices" in skin else [np.eye(4)] * len(skin["joints"]))
        joints = np.array([worlds[j] @ b for j, b in zip(skin["joints"], binds)])
        sums, attributes = np.zeros((len(p), 4, 4)), primitive["attributes"]
        for n in range(8):
            if f"JOINTS_{n}" in attributes:
                own = self.rows(attributes[f"JOINTS_{n}"]).astype(int)
                weights = self.rows(attributes[f"WEIGHTS_{n}"])
                sums += np.einsum("vk,vkij->vij", weights, joints[own])
        return np.einsum("vij,vj->vi", sums[:, :3], np.c_[p, np.ones(len(p))])

    def poses(self):
        """Names and node poses of the skin."""
        if not self.json.get("skins"):
            return []
        poses = [("nodes", lambda file: file.locals())]
        moves = [a for a in range(len(self.json.get("animations", [])))
                 if any(c["target"].get("path") in ("rotation", "translation", "scale")
                        for c in self.json["animations"][a]["channels"])]
        for a in moves:
            for k in range(TIMES):
                share = (k + 0.5) / TIMES
                poses.append((f"animation {a} at {share}",
                              lambda file, a=a, share=share: file.animated(file.json["animations"][a], share)))
        return poses if moves else poses + [("turned", lambda file: file.turned())]

    def target_count(self):
        meshes = [self.json["meshes"][n["mesh"]] for n in self.mesh_nodes()]
        return max(len(p.get("targets", [])) for m in meshes for p in m["primitives"])


def matrix(local):
    if local["m"] is not None:
        return local["m"]
    x, y, z, w = local["r"] / np.linalg.norm(local["r"])
    m = np.eye(4)
    m[:3, :3] = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]) * local["s"]  # fmt: skip
    m[:3, 3] = local["t"]
    return m


def quaternion(a, b):
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return np.array([aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                     aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz])


def samples(positions, triangles):
    random = np.random.default_rng(1)
    corners = positions[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    own = corners[random.choice(len(triangles), SAMPLES, p=areas / areas.sum())]
    u, v = random.random((2, SAMPLES, 1))
    root = np.sqrt(u)
    return own[:, 0] * (1 - root) + own[:, 1] * root * (1 - v) + own[:, 2] * root * v


def distance(source, level):
    """Two-sided RMS and maximum, in the units of the scene."""
    one = igl.point_mesh_squared_distance(samples(*source), *level)[0]
    other = igl.point_mesh_squared_distance(samples(*level), *source)[0]
    return np.sqrt((one.mean() + other.mean()) / 2), np.sqrt(max(one.max(), other.max()))


def measure(source, level, length=None):
    """RMS at rest, over poses and over targets, and the least share of a largest delta."""
    def figure(pose, target=None):
        a, b = source.surface(pose and pose(source), target), level.surface(pose and pose(level), target)
        return distance(a, b)[0] / (length or np.linalg.norm(np.ptp(a[0], axis=0)))
    square = lambda figures: float(np.sqrt(np.mean(np.square(figures)))) if figures else 0.0
    poses = square([figure(pose) for _, pose in source.poses()])
    count = source.target_count()
    targets = square([figure(None, target) for target in range(count)])
    rest = source.surface()[0], level.surface()[0]
    peaks = [
        np.linalg.norm(level.surface(None, t)[0] - rest[1], axis=1).max()
        / max(np.linalg.norm(source.surface(None, t)[0] - rest[0], axis=1).max(), 1e-30)
        for t in range(count)
    ]
    return figure(None), poses, targets, min(peaks, default=1.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path)
    parser.add_argument("levels", type=Path, nargs="+")
    parser.add_argument("--length", type=float)
    arguments = parser.parse_args()
    source = File(arguments.source)
    for path in arguments.levels:
        rest, poses, targets, peak = measure(source, File(path), arguments.length)
        print(f"{path.name:32} rest {rest:.6f}  poses {poses:.6f}  targets {targets:.6f}  peak {peak:.3f}")


if __name__ == "__main__":
    main()
