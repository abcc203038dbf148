#!/usr/bin/env python3
"""Bakes the cases of ../shared/cases that move, fold, lie in layers or fall apart, and measures the levels.

Nothing of the project's own evaluator is in it: files are read and posed with numpy (motion.py), and
nearest points are libigl's. Prints the figures of all four levels, and exits with 1 if one is beyond its
limit. Needs what the peers need (see ../peers/setting.py).
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "peers"))

import setting

setting.enter_environment()

import igl
import numpy as np

from motion import File, distance, measure

CASES = setting.ROOT.parent / "shared" / "cases"


class Bake:
    """A case and its levels."""

    def __init__(self, binary, name, folder, *options):
        self.path = CASES / f"{name}.glb"
        command = [binary, "bake", self.path, "-o", folder, "--no-evaluate", *options]
        done = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)
        self.messages = done.stderr
        self.source = File(self.path)
        self.levels = [File(folder / f"{self.path.stem}_lod{n}.glb") for n in (1, 2, 3, 4)]


def normals(positions, triangles):
    corners = positions[triangles]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def area(file):
    return np.linalg.norm(normals(*file.surface()), axis=1).sum() / 2


def limb(bake):
    figures = []
    for level in bake.levels:
        pose = lambda file: file.surface(file.locals())
        figures.append(distance(pose(bake.source), pose(level))[0] / 10)
    return "posed RMS over its length", figures, figures[3] <= 0.004


def bump(bake):
    figures = [measure(bake.source, level)[3] for level in bake.levels]
    return "least height of a bump", figures, figures[1] >= 0.95


def tin(bake):
    figures = [int((normals(*level.surface())[:, 2] <= 0).sum()) for level in bake.levels]
    return "triangles that turn their backs", figures, max(figures) == 0


def parts(file):
    """Positions and triangles of each primitive."""
    primitives = [p for n in file.mesh_nodes() for p in file.json["meshes"][n["mesh"]]["primitives"]]
    return {
        file.json["materials"][p["material"]]["name"]: (
            file.rows(p["attributes"]["POSITION"]),
            file.rows(p["indices"]).astype(np.int64).reshape(-1, 3),
        )
        for p in primitives
    }


def decal(bake):
    figures = []
    for level in bake.levels:
        own = parts(level)
        wall, (positions, triangles) = own["wall"], own["decal"]
        random, corners = np.random.default_rng(3), positions[triangles]
        areas = np.linalg.norm(normals(positions, triangles), axis=1)
        picked = corners[random.choice(len(triangles), 20_000, p=areas / areas.sum())]
        shares = random.dirichlet([1, 1, 1], len(picked))
        places = np.einsum("nk,nkc->nc", shares, picked)
        # The wall is a graph over z.
        height = heights(wall[0][:, :2], wall[0][:, 2], wall[1], places[:, :2])
        figures.append(float(np.mean(places[:, 2] < height)))
    return "share of the decal below the wall", figures, figures[3] < 0.02


def heights(flat, z, triangles, places):
    """The height over each place of a surface that is a graph over the plane."""
    lifted = np.c_[flat, np.zeros(len(flat))]
    _, found, nearest = igl.point_mesh_squared_distance(np.c_[places, np.zeros(len(places))], lifted, triangles)
    a, b, c = (lifted[triangles[found, k]] for k in range(3))
    shares = igl.barycentric_coordinates(np.ascontiguousarray(nearest), a, b, c)
    return np.einsum("nk,nk->n", shares, z[triangles[found]])


def leaves(bake):
    whole = area(bake.source)
    figures = [area(level) / whole for level in bake.levels]
    count = len(bake.levels[2].surface()[1]) / len(bake.source.surface()[1])
    print(f"  triangles at level 3: {count:.4f} of the source's")
    return "area over the source's", figures, figures[2] >= 0.8 and count <= 0.126


def fragments(bake):
    says = "--textures" in bake.messages
    print("  " + next((line for line in bake.messages.splitlines() if "--textures" in line), "no word"))
    return "says a way out", [float(says)], says


CHECKS = {
    "motion/skin_straight_limb": (limb, []),
    "motion/morph_flat_base": (bump, []),
    "surface/tin_rough": (tin, []),
    "surface/decal_prims": (decal, []),
    "surface/leaves_single_quads": (leaves, ["--grow-cards", "on"]),
    "surface/pertri": (fragments, []),
}


def main():
    if not CASES.is_dir():
        print(f"skipped: {CASES} is absent")
        return 0
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seamwise", type=Path, required=True, help="the binary")
    parser.add_argument("names", nargs="*", help="parts of the names of cases; all if not given")
    arguments = parser.parse_args()
    binary, names, failed = arguments.seamwise.resolve(), arguments.names, 0
    with tempfile.TemporaryDirectory() as folder:
        for name, (check, options) in CHECKS.items():
            if names and not any(own in name for own in names):
                continue
            what, figures, good = check(Bake(binary, name, Path(folder), *options))
            row = "  ".join(f"{figure:.4f}" for figure in figures)
            print(f"{name}: {what}: {row}{'' if good else '   BEYOND ITS LIMIT'}")
            failed += not good
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
