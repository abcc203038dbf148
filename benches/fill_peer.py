#!/usr/bin/env python3
"""Holds the pull-push of Seamwise against `fillholes_pushpull` of OpenImageIO.

Both fill the same holes in the same smooth field, in memory and in 32-bit floats, on two threads and
in turns; files and the making of the field are outside the clock. The field and the mask are those of
benches/pyramid.rs. Prints the medians, and the RMS error of what was filled.

Run it with a Python that has OpenImageIO and numpy:

    python3 -m venv peers && peers/bin/pip install openimageio numpy
    peers/bin/python benches/fill_peer.py
"""

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

ROOT = Path(__file__).resolve().parent.parent
SIZES = [2048, 8192]
THREADS = 2
TURNS = 3


def atlas(size):
    """The field, as float RGB, and where it is valid."""
    at = (np.arange(size) + 0.5) / size * 2 * np.pi
    u, v = at[None, :], at[:, None]
    red = 0.5 + 0.4 * np.sin(1.5 * u) * np.cos(v)
    green = 0.5 + 0.4 * np.cos(u + 2 * v)
    blue = np.broadcast_to(u / (2 * np.pi), (size, size))
    texel = np.arange(size)
    columns = texel % 64 < 48
    rows = (texel % 64 < 48) & (texel % 256 < 192)
    return np.stack([red, green, blue], axis=2).astype(np.float32), rows[:, None] & columns[None, :]


def theirs(field, valid):
    """Seconds and RMS error of OpenImageIO."""
    size = len(field)
    texels = np.zeros((size, size, 4), np.float32)
    texels[valid, :3] = field[valid]
    texels[valid, 3] = 1
    source = oiio.ImageBuf(oiio.ImageSpec(size, size, 4, oiio.FLOAT))
    source.set_pixels(oiio.ROI(), texels)
    filled = oiio.ImageBuf()
    start = time.perf_counter()
    if not oiio.ImageBufAlgo.fillholes_pushpull(filled, source, nthreads=THREADS):
        sys.exit(filled.geterror())
    seconds = time.perf_counter() - start
    found = filled.get_pixels(oiio.FLOAT)[~valid]
    # Where their alpha is below 1, colors are times alpha.
    found = found[:, :3] / np.maximum(found[:, 3:], 1e-6)
    return seconds, float(np.sqrt(np.mean((found - field[~valid]) ** 2, dtype=np.float64)))


def ours(bench, size):
    """Seconds and RMS error of Seamwise."""
    environment = {**os.environ, "RAYON_NUM_THREADS": str(THREADS)}
    run = [bench, "--once", str(size)]
    out = subprocess.run(run, env=environment, check=True, capture_output=True, text=True).stdout
    return tuple(float(figure) for figure in out.split())


def build():
    """Builds the bench and tells where it is."""
    run = ["cargo", "bench", "--bench", "pyramid", "--no-run"]
    told = subprocess.run(run, cwd=ROOT, check=True, capture_output=True, text=True).stderr
    return ROOT / told.rsplit("(", 1)[1].split(")")[0]


def main():
    oiio.attribute("threads", THREADS)
    bench = build()
    print("size   ours s  theirs s  ratio   ours RMS  theirs RMS")
    for size in SIZES:
        field, valid = atlas(size)
        turns = [(ours(bench, size), theirs(field, valid)) for _ in range(TURNS)]
        own, peer = (statistics.median(turn[who][0] for turn in turns) for who in (0, 1))
        errors = [turns[0][who][1] for who in (0, 1)]
        print(f"{size:5} {own:8.3f} {peer:9.3f} {own / peer:6.2f} {errors[0]:10.2e} {errors[1]:11.2e}")


if __name__ == "__main__":
    main()
