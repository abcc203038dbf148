#!/usr/bin/env python3
"""Opens in Blender what a bake writes, and holds how many triangles are there to README's table.

    python3 blender.py SEAMWISE MODEL

Needs bpy on the path (pip install bpy); says so and skips without it. A level is a file of its own, and
opens as such; of a file with MSFT_lod Blender shows the source, with the levels in a collection that is
out of sight (`Orphan Nodes`); of a file with names it shows all levels at once; compressed geometry it
refuses.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import bpy
except ImportError:
    print("skipped: bpy is absent, so Blender opens nothing")
    sys.exit(0)


def triangles(path):
    """Triangles of all meshes of a file that the scene shows; None if it can't be opened."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        bpy.ops.import_scene.gltf(filepath=str(path))
    except RuntimeError:
        return None
    shown = [item for item in bpy.context.scene.objects if item.type == "MESH" and item.visible_get()]
    for item in shown:
        item.data.calc_loop_triangles()
    return sum(len(item.data.loop_triangles) for item in shown)


def bake(tool, model, folder, *options):
    """Bakes two levels; the triangles of source and levels by the report."""
    arguments = ["--levels", "2", "--no-evaluate", "--quiet", *options]
    subprocess.run([tool, "bake", model, "-o", folder, *arguments], check=True)
    report = json.loads((folder / (pathlib.Path(model).stem + ".json")).read_text())
    return [report["input"]["triangles"], *(level["triangles"] for level in report["levels"])]


def main():
    tool, model = sys.argv[1:]
    stem = pathlib.Path(model).stem
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        for name, options, file, expect in [
            ("a level", [], "{}_lod1.glb", lambda counts: counts[1]),
            ("a level as .gltf", ["--format", "gltf"], "{}_lod1.gltf", lambda counts: counts[1]),
            ("MSFT_lod: the source", ["--layout", "msft_lod"], "{}.glb", lambda counts: counts[0]),
            ("names: all levels at once", ["--layout", "names"], "{}.glb", sum),
            ("--compress: refused", ["--compress"], "{}_lod1.glb", lambda _: None),
        ]:
            place = pathlib.Path(folder) / str(len(name))
            counts = bake(tool, model, place, *options)
            found, expected = triangles(place / file.format(stem)), expect(counts)
            print(f"Blender {bpy.app.version_string}, {name}: {found} triangles of {counts}")
            if found != expected:
                wrong.append(f"{name}: {found} triangles, expected {expected}")
    if wrong:
        sys.exit("\n".join(wrong))


main()
