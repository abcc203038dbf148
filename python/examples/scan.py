"""A scan at a quarter of its triangles, its atlas repaired, and how far that is from the scan."""

import json
import sys

import trimesh

import seamwise
import seamwise.trimesh

source, output = sys.argv[1:]
scan = trimesh.load(source, force="mesh")
(quarter,) = seamwise.trimesh.simplify(scan, [0.25])
whole = seamwise.trimesh.repair(quarter)
whole.export(output)
(figures,) = seamwise.evaluate(source, output)
print(f"{len(scan.faces):,} triangles became {len(whole.faces):,}", file=sys.stderr)
json.dump(figures, sys.stdout, indent=2)
