#!/usr/bin/env python3
"""Loads .glb and .gltf files with trimesh and prints how many triangles each has.

    python3 load.py FILE…

Needs trimesh on the path. Fails if a file can't be loaded or has no triangle.
"""

import sys

import trimesh

for path in sys.argv[1:]:
    scene = trimesh.load_scene(path)
    triangles = sum(len(mesh.faces) for mesh in scene.dump() if hasattr(mesh, "faces"))
    print(f"{path}: {triangles} triangles")
    if triangles == 0:
        sys.exit(f"{path}: trimesh finds no triangle")
