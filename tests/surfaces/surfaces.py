#!/usr/bin/env python3
"""Measures levels of inputs that go wrong at seams, sheets, scales and borders, with other people's code.

The inputs are those of ../shared/cases/surface and some that are made here, of the same kinds:

- cracks: how far apart borders of a level come that are one, or nearly, in the source;
- tiles: whether neighbors that are baked alone meet to the bit with --lock-border, and what outline an
  open tile keeps;
- scale: how far a level is from its source where a node is scaled along one axis, beside the same shape
  with the scale applied;
- sheets: what area and outline a sheet doubled by flipped copies keeps, beside the single sheet.

Needs what the peers need (see ../peers/setting.py). Exits with 1 if a limit is broken.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "peers"))

import setting

setting.enter_environment()

import igl
import numpy as np

import gltf

CASES = setting.ROOT.parent / "shared" / "cases" / "surface"
LEVELS = (1, 2, 3, 4)
SAMPLES = 40_000
RESOLUTION = 512
failures = []


def check(name, figures, limits):
    """Prints a row of figures, and remembers those above their limits."""
    figures, limits = np.atleast_1d(figures), np.broadcast_to(limits, np.shape(figures))
    broken = np.any(figures > limits)
    row = "  ".join(f"{figure:.6f}" for figure in figures)
    print(f"{name:44} {row}   at most {limits[0]:.6f}{'   BROKEN' if broken else ''}")
    if broken:
        failures.append(name)


class Shown:
    """What a file shows, in world space."""

    def __init__(self, path):
        surfaces = gltf.Document.read(path).surfaces()
        corners = [s.positions[s.triangles].reshape(-1, 3) for s in surfaces]
        self.corners = np.concatenate(corners).astype(np.float64)
        self.positions, soup = np.unique(self.corners, axis=0, return_inverse=True)
        a, b, c = soup.reshape(-1, 3).T
        self.triangles = soup.reshape(-1, 3)[(a != b) & (b != c) & (c != a)]
        self.low, self.high = self.corners.min(0), self.corners.max(0)
        self.diagonal = float(np.linalg.norm(self.high - self.low))

    def area(self):
        a, b, c = (self.positions[self.triangles[:, k]] for k in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    def borders(self):
        """The edges of one triangle alone, as pairs of points."""
        t = self.triangles
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        edges, counts = np.unique(edges, axis=0, return_counts=True)
        return edges[counts == 1]

    def gap(self):
        """The largest distance of the middle of a border edge to the next border edge; of borders along the
        sides of the box around all none counts."""
        edges = self.borders()
        ends = self.positions[edges]
        near = 5e-3 * self.diagonal
        on_side = lambda side: (np.abs(ends - side) < near).all(1).any(1)
        edges = edges[~(on_side(self.low) | on_side(self.high))]
        if len(edges) < 2:
            return 0.0
        a, b = self.positions[edges[:, 0]], self.positions[edges[:, 1]]
        along = b - a
        squares = np.einsum("ij,ij->i", along, along)
        worst = 0.0
        for own, middle in enumerate((a + b) / 2):
            share = np.einsum("ij,ij->i", middle - a, along) / squares
            feet = a + np.clip(share, 0, 1)[:, None] * along
            distances = np.linalg.norm(feet - middle, axis=1)
            distances[own] = np.inf
            worst = max(worst, float(distances.min()))
        return worst

    def samples(self, count=SAMPLES):
        a, b, c = (self.positions[self.triangles[:, k]] for k in range(3))
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        random = np.random.default_rng(7)
        triangle = random.choice(len(areas), count, p=areas / areas.sum())
        u, v = np.sqrt(random.random((count, 1))), random.random((count, 1))
        return a[triangle] * (1 - u) + b[triangle] * (u * (1 - v)) + c[triangle] * (u * v)

    def rms_to(self, other):
        squares, _, _ = igl.point_mesh_squared_distance(
            self.samples(), other.positions, other.triangles.astype(np.int64)
        )
        return float(np.sqrt(squares.mean()))

    def distance(self, other):
        return max(self.rms_to(other), other.rms_to(self))

    def silhouette(self, frame):
        """The pixels that the surface covers, seen along the axis that it is flattest along."""
        low, high = frame
        flat = int(np.argmin(high - low))
        axes = [axis for axis in range(3) if axis != flat]
        scale = (RESOLUTION - 8) / (high - low)[axes].max()
        flat_corners = (self.corners[:, axes] - low[axes]) * scale + 4
        pixels = np.zeros((RESOLUTION, RESOLUTION), bool)
        for corners in flat_corners.reshape(-1, 3, 2):
            fill(pixels, corners)
        return pixels


def fill(pixels, corners):
    """Sets the pixels whose centers a triangle covers."""
    low = np.maximum(np.floor(corners.min(0) - 0.5).astype(int), 0)
    high = np.minimum(np.ceil(corners.max(0) + 0.5).astype(int), RESOLUTION - 1)
    x, y = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1), indexing="ij")
    centers = np.stack([x, y], -1) + 0.5
    cross = lambda u, v: u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    sides = [cross(corners[(k + 1) % 3] - corners[k], centers - corners[k]) for k in range(3)]
    inside = np.all([s >= 0 for s in sides], 0) | np.all([s <= 0 for s in sides], 0)
    pixels[x[inside], y[inside]] = True


def overlap(a, b):
    """The share that two shapes have in common of what either covers."""
    return float((a & b).sum() / (a | b).sum())


def levels(tool, path, *options):
    folder = tool.folder / f"{path.stem}{len(options)}"
    tool.run("bake", path, "--no-evaluate", *options, "-o", folder)
    return [Shown(folder / f"{path.stem}_lod{level}.glb") for level in LEVELS]


def cracks(tool, path):
    source = Shown(path)
    gaps = [level.gap() for level in levels(tool, path)]
    most = source.gap() * 1.001 + 3e-7 * source.diagonal
    check(f"{path.stem}: gaps", gaps, most)


def tiles(tool, paths):
    """Neighbors along one axis, each baked alone."""
    sources = [Shown(path) for path in paths]
    axis = int(np.argmax(np.abs(sources[1].low - sources[0].low)))
    cut = sources[0].high[axis]
    own = [levels(tool, path, "--lock-border") for path in paths]
    unlike = []
    for pair in zip(*own):
        sets = [{tuple(p) for p in shown.positions if p[axis] == cut} for shown in pair]
        unlike.append(len(sets[0] ^ sets[1]) + (0 if sets[0] else 1))
    check("tiles: points that the other lacks", unlike, 0)
    for options in ([], ["--keep-area"]):
        source = sources[0]
        frame = (source.low, source.high)
        whole = source.silhouette(frame)
        outlines = [1 - overlap(level.silhouette(frame), whole) for level in levels(tool, paths[0], *options)]
        check(f"tile {' '.join(options)}: outline lost", outlines, 0.02)


def applied(path, folder):
    """The same file with the transform of its node applied."""
    (surface,) = gltf.Document.read(path).surfaces()
    return Path(gltf.build(surface.positions, surface.triangles, surface.normals).write(folder / "applied.glb"))


def scale(tool, path):
    source = Shown(path)
    plain = applied(path, tool.folder)
    ours = [source.distance(level) for level in levels(tool, path)]
    same = [source.distance(level) for level in levels(tool, plain)]
    check(f"{path.stem}: RMS over that of the scale applied", np.divide(ours, same), 1.1)


def single(path, folder):
    """One of the two sheets of a file of doubled ones: the triangles whose points none before them had."""
    surfaces, parts, seen, first = gltf.Document.read(path).surfaces(), [], set(), 0
    for surface in surfaces:
        kept = []
        for triangle in surface.triangles:
            center = surface.positions[triangle].mean(0)
            key = tuple(np.round(center / np.ptp(surface.positions, axis=0).max(), 5))
            if key not in seen:
                seen.add(key)
                kept.append(triangle)
        if kept:
            parts.append((surface.positions, np.array(kept) + first))
            first += len(surface.positions)
    positions = np.concatenate([p for p, _ in parts])
    triangles = np.concatenate([t for _, t in parts])
    return Path(gltf.build(positions, triangles).write(folder / f"{path.stem}_single.glb"))


def sheets(tool, path):
    doubled, one = Shown(path), single(path, tool.folder)
    source = Shown(one)
    frame = (source.low, source.high)
    pairs = list(zip(levels(tool, path), levels(tool, one)))
    areas = [abs(own.area() / doubled.area() - alone.area() / source.area()) for own, alone in pairs]
    check(f"{path.stem}: area beside the single sheet's", areas, 0.01)
    whole = source.silhouette(frame)
    outlines = [
        overlap(alone.silhouette(frame), whole) - overlap(own.silhouette(frame), whole)
        for own, alone in pairs
    ]
    check(f"{path.stem}: outline beside the single sheet's", outlines, 0.01)


def torus(folder):
    """A torus whose last row and column are computed, not copied: off the first by a rounding."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 73), np.linspace(0, 2 * np.pi, 31))
    ring = 2 + 0.7 * np.cos(v)
    positions = np.stack([ring * np.cos(u), 0.7 * np.sin(v), ring * np.sin(u)], -1).reshape(-1, 3)
    return Path(gltf.build(positions, gltf.grid(30, 72)).write(folder / "made_torus.glb"))


def chunks(folder):
    """Four terrain chunks with coordinates of their own, placed by nodes, one of them turned about."""
    lines = np.linspace(0, 1, 25)
    document = None
    for number, (x, y) in enumerate([(0, 0), (1, 0), (0, 1), (1, 1)]):
        u, v = np.meshgrid(lines + x, lines + y)
        height = 0.1 * np.sin(5.3 * u) * np.cos(4.1 * v)
        move = np.array([x * 1.1 + 0.3, 0, y * 1.1 - 0.7])
        world = np.stack([1.1 * u + 0.3, height, 1.1 * v - 0.7], -1).reshape(-1, 3)
        own = world - move
        turn = [0, 0, 0, 1]
        if number == 2:
            # A third of a turn about the vertical.
            turn = [0, float(np.sin(np.pi / 3)), 0, float(np.cos(np.pi / 3))]
            rotation = gltf.local_transform({"rotation": turn})[:3, :3]
            own = own @ rotation
        part = gltf.build(own, gltf.grid(24, 24))
        node = {"mesh": number, "translation": move.tolist(), "rotation": turn}
        document = part if document is None else append(document, part)
        document.json["nodes"] = document.json["nodes"][:number] + [node]
        document.json["scenes"][0]["nodes"] = list(range(number + 1))
    return Path(document.write(folder / "made_chunks.glb"))


def append(document, part):
    """A document with the mesh of another."""
    own, other = document.json, part.json
    (binary,), (more,) = document.buffers, part.buffers
    views, accessors = len(own["bufferViews"]), len(own["accessors"])
    for view in other["bufferViews"]:
        own["bufferViews"].append(view | {"byteOffset": view["byteOffset"] + len(binary)})
    for accessor in other["accessors"]:
        own["accessors"].append(accessor | {"bufferView": accessor["bufferView"] + views})
    (primitive,) = other["meshes"][0]["primitives"]
    attributes = {name: at + accessors for name, at in primitive["attributes"].items()}
    mesh = {"primitives": [{"indices": primitive["indices"] + accessors, "attributes": attributes}]}
    own["meshes"].append(mesh)
    own["buffers"] = [{"byteLength": len(binary) + len(more)}]
    return gltf.Document(own, [binary + more])


def main():
    tool = setting.Tool(__doc__, lambda parser: None)
    cracks(tool, torus(tool.folder))
    cracks(tool, chunks(tool.folder))
    if CASES.is_dir():
        cracks(tool, CASES / "threejs_torus.glb")
        cracks(tool, CASES / "draco_grid_two_prims.glb")
        tiles(tool, [CASES / "tile_0.glb", CASES / "tile_1.glb"])
        scale(tool, CASES / "node_scale.glb")
        sheets(tool, CASES / "double_sided_sheet.glb")
        sheets(tool, CASES / "wicker_double_sheet.glb")
    else:
        print(f"skipped: {CASES} is absent, so only what is made here is measured")
    sys.exit(1 if failures else 0)


main()
