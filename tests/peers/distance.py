#!/usr/bin/env python3
"""Holds the surface distances of `seamwise evaluate` against those of PyMeshLab and libigl.

PyMeshLab's get_hausdorff_distance is the code of Metro, the tool that the measure comes from
(Cignoni, Rocchini & Scopigno, 1998). It gives the RMS, over samples spread by area. The maximum
has peaks that are narrower than the distance between samples, so that two sampled maxima differ by
up to 25 % here and neither is right; it comes from libigl's nearest points, with the
triangles cut until a bound shows that no point is farther by more than 3 %. PyMeshLab's own maximum
is shown beside it; with --dense, where it is more than 5 % off, it is sought again among
10,000,000 samples, up to three times, and then it must agree within 5 % too. Both ways, from the reference to the candidate and back, are
compared

- on shapes whose distances are known, where all tools must be right within 1 %;
- on three real assets and their four levels, where we must agree with the peers within 3 % (RMS)
  and 5 % (max), and no sample or vertex of PyMeshLab may lie farther than our maximum allows.

All tools must also see as many triangles, and a bounding box of the same size.

Needs Python 3.11 or later with venv, the assets in ../shared/assets (the known shapes go without),
and, on the first run, the network: it makes its own environment (see setting.py). Takes about a
minute once that is there, with --dense seven. Exits with 1 if a limit is broken.
"""

import sys

import setting

setting.enter_environment()

import igl
import numpy as np
import pymeshlab

import gltf

ASSETS = ["scan/popcorn.glb", "scan/frypan.glb", "pbr/FlightHelmet/FlightHelmet.gltf"]
SAMPLES, DENSE_SAMPLES, DENSE_TRIES = 200_000, 10_000_000, 3
KNOWN_LIMIT, RMS_LIMIT, MAX_LIMIT = 0.01, 0.03, 0.05
BOUND = 0.03
HEAD = (
    f"{'':18}{'way':8}{'RMS':>12}{'PyMeshLab':>12}{'off':>8}"
    f"{'max':>14}{'libigl':>12}{'off':>8}{'PyMeshLab':>12}{'off':>8}"
)


class Peer:
    """A surface as the peers see it."""

    def __init__(self, path):
        surfaces = gltf.Document.read(path).surfaces()
        corners = np.concatenate([s.positions[s.triangles].reshape(-1, 3) for s in surfaces])
        corners = corners.astype(np.float64)
        # Equal positions are one vertex, so that the vertices are sampled once each.
        self.positions, soup = np.unique(corners, axis=0, return_inverse=True)
        self.triangles = soup.reshape(-1, 3)
        self.corners = self.positions[self.triangles]
        self.diagonal = float(np.linalg.norm(np.ptp(self.positions, axis=0)))
        self.mesh = pymeshlab.Mesh(self.positions, self.triangles)
        self.tree = igl.AABB()
        self.tree.init(self.positions, self.triangles)

    def sampled(self, other, samples=SAMPLES):
        """PyMeshLab's RMS and maximum of the distance to another, in world units."""
        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(self.mesh)
        meshes.add_mesh(other.mesh)
        measure = lambda **samples: meshes.get_hausdorff_distance(
            sampledmesh=0, targetmesh=1, maxdist=pymeshlab.PercentageValue(100), **samples
        )
        # Apart, because vertices would weigh in the RMS as much as samples spread by area. If
        # fewer samples than vertices are asked for, only some of the vertices are looked at, and
        # the default is the number of the other mesh's.
        faces = measure(samplevert=False, sampleface=True, samplenum=samples)
        vertices = measure(samplevert=True, samplenum=len(self.positions))
        assert vertices["n_samples"] == len(self.positions)
        return faces["RMS"], max(faces["max"], vertices["max"])

    def sampled_until(self, other, greatest, sampled):
        """The maximum of ever more samples, until `greatest` is within the limit of it."""
        for _ in range(DENSE_TRIES):
            if abs(greatest / sampled - 1) <= MAX_LIMIT:
                break
            sampled = max(sampled, self.sampled(other, DENSE_SAMPLES)[1])
        return sampled

    def farthest(self, other, greatest):
        """The greatest distance of any point to another, within BOUND, in world units; `greatest`
        is that of some point."""
        pieces = self.corners
        while len(pieces):
            centers = pieces.mean(1)
            squares, triangles, _ = other.nearest(centers)
            distances = np.sqrt(squares)
            greatest = max(greatest, distances.max())
            radii = np.linalg.norm(pieces - centers[:, None], axis=2).max(1)
            bounds = np.minimum(distances + radii, reach(pieces, other.corners[triangles]))
            enough = greatest * (1 + BOUND) + 1e-5 * other.diagonal
            pieces = quarter(pieces[bounds > enough])
        return greatest

    def nearest(self, points):
        """Squared distances, triangles and points."""
        return self.tree.squared_distance(self.positions, self.triangles, points)


def reach(pieces, triangles):
    """For each piece and its triangle a length within which all of the piece is from it.

    The distance to a triangle is convex, so it is greatest at a corner of the piece; and the
    distance of that to any point of the triangle is at least as much.
    """
    a, b, c = (triangles[:, None, k] for k in range(3))
    ab, ac, ap = b - a, c - a, pieces - a
    dot = lambda x, y: (x * y).sum(-1)
    square = dot(ab, ab) * dot(ac, ac) - dot(ab, ac) ** 2
    # The foot of the corner, moved into the triangle; the first corner of one without area.
    scale = np.divide(1, square, out=np.zeros_like(square), where=square > 0)
    v = (dot(ac, ac) * dot(ap, ab) - dot(ab, ac) * dot(ap, ac)) * scale
    w = (dot(ab, ab) * dot(ap, ac) - dot(ab, ac) * dot(ap, ab)) * scale
    weights = np.stack([1 - v - w, v, w], -1).clip(0, None)
    weights /= weights.sum(-1, keepdims=True)
    points = np.einsum("ijk,ikl->ijl", weights, triangles)
    return np.linalg.norm(pieces - points, axis=2).max(1)


def quarter(pieces):
    """Each triangle cut at the middles of its edges."""
    middles = (pieces + np.roll(pieces, -1, axis=1)) / 2
    outer = [np.stack([pieces[:, k], middles[:, k], middles[:, k - 1]], 1) for k in range(3)]
    return np.concatenate([*outer, middles])


class Table:
    """Prints the pairs, and remembers whether one broke its limit."""

    def __init__(self, dense=False):
        self.dense = dense
        self.failures = 0
        self.worst = [0.0, 0.0]
        self.sampled = [0.0, 0]

    def add(self, name, way, own, peer, limits, sampled=None):
        """`own` and `peer`: RMS and maximum; `sampled`: a distance that was found somewhere."""
        off = [a / b - 1 for a, b in zip(own, peer)]
        broken = any(not abs(o) <= limit for o, limit in zip(off, limits))
        if sampled is not None:
            broken |= not sampled <= own[1] * (1 + limits[1])
            broken |= self.dense and not own[1] <= sampled * (1 + limits[1])
        self.failures += broken
        self.worst = [max(w, abs(o)) for w, o in zip(self.worst, off)]
        cells = "  ".join(f"{a:12.4e}{b:12.4e}{o:+8.2%}" for a, b, o in zip(own, peer, off))
        if sampled is not None:
            short = own[1] / sampled - 1
            self.sampled = [max(self.sampled[0], abs(short)), self.sampled[1] + (abs(short) > 0.05)]
            cells += f"{sampled:12.4e}{short:+8.2%}"
        print(f"{name:18}{way:8}{cells}{'  broken' if broken else ''}", flush=True)


def compare(tool, table, reference, candidates, known=None):
    """Adds both ways of each candidate; `known` is what both tools must find."""
    options = ["--samples", SAMPLES, "--views", 1, "--resolution", 16]
    report = tool.evaluate(reference, candidates, *options)
    source = Peer(reference)
    diagonal = report["reference"]["diagonal"]
    assert len(source.triangles) == report["reference"]["triangles"], "not the same triangles"
    assert abs(source.diagonal / diagonal - 1) < 1e-6, (source.diagonal, diagonal)
    for path, candidate in zip(candidates, report["candidates"]):
        peer = Peer(path)
        assert len(peer.triangles) == candidate["triangles"], "not the same triangles"
        for way, there, back in [("forward", source, peer), ("backward", peer, source)]:
            own = candidate["metrics"][way]
            own = (own["distance_rms"] * diagonal, own["distance_max"] * diagonal)
            rms, sampled = there.sampled(back)
            found = (rms, there.farthest(back, sampled))
            if table.dense:
                sampled = there.sampled_until(back, own[1], sampled)
            if known is None:
                table.add(path.stem, way, own, found, (RMS_LIMIT, MAX_LIMIT), sampled)
            else:
                limits = (KNOWN_LIMIT, KNOWN_LIMIT)
                table.add(f"{path.stem}: we", way, own, known[way], limits)
                table.add(f"{path.stem}: peers", way, found, known[way], limits)


def sphere(radius, side=128):
    polar, around = np.meshgrid(
        np.linspace(0, np.pi, side + 1), np.linspace(0, 2 * np.pi, 2 * side + 1), indexing="ij"
    )
    ring = np.sin(polar)
    points = np.stack([ring * np.cos(around), ring * np.sin(around), np.cos(polar)], -1)
    return gltf.build(points.reshape(-1, 3) * radius, gltf.grid(side, 2 * side))


def rectangle(width, height, lift, side=32):
    x, y = np.meshgrid(
        np.linspace(0, width, side + 1), np.linspace(0, height, side + 1), indexing="ij"
    )
    points = np.stack([x, y, np.full_like(x, lift)], -1)
    return gltf.build(points.reshape(-1, 3), gltf.grid(side, side))


def compare_known(tool, table):
    write = lambda name, document: document.write(tool.folder / f"{name}.glb")
    same = lambda distance: {way: (distance, distance) for way in ("forward", "backward")}
    compare(
        tool, table, write("unit", sphere(1.0)), [write("sphere", sphere(1.01))], same(0.01)
    )
    unit = write("square", rectangle(1, 1, 0))
    compare(tool, table, unit, [write("parallel", rectangle(1, 1, 0.1))], same(0.1))
    # One twice as wide at height h: over the half that juts out the square of the distance is
    # h² + x², x in 0…1, so its mean over both halves is h² + 1/6, and the farthest is √(h² + 1).
    h = 0.1
    known = {"forward": (h, h), "backward": ((h * h + 1 / 6) ** 0.5, (h * h + 1) ** 0.5)}
    compare(tool, table, unit, [write("wider", rectangle(2, 1, h))], known)


def add_options(parser):
    parser.add_argument(
        "--levels", type=int, nargs="+", choices=range(1, 5), default=[1, 2, 3, 4],
        help="which of an asset's levels to compare; all if not given",
    )  # fmt: skip
    parser.add_argument(
        "--dense", action="store_true", help="hold PyMeshLab's own maximum to the limit, too"
    )


def main():
    tool = setting.Tool(__doc__, add_options)
    print(f"Distances in world units, {SAMPLES:,} samples. Shapes of known distances:\n\n{HEAD}")
    known = Table()
    compare_known(tool, known)
    print(f"\nReal assets and their levels:\n\n{HEAD}")
    table = Table(tool.options.dense)
    for asset in setting.find_assets(ASSETS):
        compare(tool, table, asset, tool.bake(asset, tool.options.levels))
    rms, greatest = table.worst
    print(f"\nReal assets at most {rms:.2%} (RMS) and {greatest:.2%} (max) apart")
    farthest, many = table.sampled
    print(f"PyMeshLab's sampled maxima at most {farthest:.2%} apart, {many} by more than 5 %")
    failures = known.failures + table.failures
    print(f"{failures} pairs beyond the limits" if failures else "All within the limits")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
