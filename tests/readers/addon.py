#!/usr/bin/env python3
"""Runs the add-on in Blender: levels as collections that wear their source's materials, an atlas repaired
to the texels of the tool, figures of levels, and what the user is told when something is wrong.

    python3 addon.py SEAMWISE

Needs bpy on the path (pip install bpy); says so and skips without it. The package `seamwise` is tried as
well if Python has it.
"""

import logging
import pathlib
import sys
import tempfile

try:
    import bpy
except ImportError:
    print("skipped: bpy is absent, so nobody runs the add-on of Blender")
    sys.exit(0)

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python/blender"))
import seamwise_blender  # noqa: E402
from seamwise_blender import engine  # noqa: E402
from seamwise_blender.work import Job  # noqa: E402

SIDE = 128


def make_image(name, is_data):
    """Noise where the charts are, in the left half; magenta elsewhere."""
    texels = np.full((SIDE, SIDE, 4), [1, 0, 1, 1], np.float32)
    noise = np.random.default_rng(7).integers(0, 256, (SIDE, SIDE // 2, 3)) / 255
    texels[:, : SIDE // 2, :3] = noise if not is_data else [0.5, 0.5, 1]
    image = bpy.data.images.new(name, SIDE, SIDE, is_data=is_data)
    image.pixels.foreach_set(texels.ravel())
    image.pack()
    return image


def make_material(name, image, normal=None):
    """An image, and what glTF has no word for: noise that roughens it."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = nodes["Principled BSDF"]
    texture, noise = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeTexNoise")
    texture.image = image
    links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    links.new(noise.outputs[0], surface.inputs["Roughness"])
    if normal is not None:
        map_node, bumps = nodes.new("ShaderNodeNormalMap"), nodes.new("ShaderNodeTexImage")
        bumps.image = normal
        links.new(bumps.outputs["Color"], map_node.inputs["Color"])
        links.new(map_node.outputs["Normal"], surface.inputs["Normal"])
    return material


def make_scene():
    """A ball of two materials, moved and turned, with its UVs in the left half, under a parent."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    seamwise_blender.register()
    bpy.ops.object.empty_add(location=(1, 2, 3))
    stand = bpy.context.object
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    ball = bpy.context.object
    ball.name = "ball"
    ball.parent = stand
    ball.location, ball.rotation_euler, ball.scale = (0, 1, 0), (0.3, 0.2, 0.1), (1, 2, 1)
    image = make_image("skin", False)
    # Names that an importer has to change, and that end as such do.
    ball.data.materials.append(make_material("skin", image, make_image("bumps", True)))
    ball.data.materials.append(make_material("skin.001", image))
    for polygon in ball.data.polygons:
        polygon.material_index = polygon.center.z > 0.5
    uvs = ball.data.uv_layers.active.data
    for own in uvs:
        own.uv = (0.02 + 0.44 * own.uv[0], 0.02 + 0.96 * own.uv[1])
    bpy.context.view_layer.update()
    return ball


def triangles(own):
    own.data.calc_loop_triangles()
    return len(own.data.loop_triangles)


def choose(*objects):
    """Selects objects, the last of which is the active one."""
    for own in bpy.context.view_layer.objects:
        own.select_set(own in objects)
    bpy.context.view_layer.objects.active = objects[-1] if objects else None


def told(operator, **options):
    """What the user is told when it fails."""
    try:
        operator(**options)
    except RuntimeError as error:
        return str(error)
    raise AssertionError(f"{operator} did not fail")


def hold_levels(ball):
    before = {kind: set(getattr(bpy.data, kind).keys()) for kind in ("materials", "images")}
    materials = list(ball.data.materials)
    choose(ball)
    for _ in range(2):  # The second bake takes the place of the first.
        assert bpy.ops.object.seamwise_bake(levels=2, ratio=0.25, evaluate=False) == {"FINISHED"}
    (chain,) = [own for own in bpy.data.collections if own.name.endswith("levels")]
    assert [own.name for own in chain.children] == ["ball LOD1", "ball LOD2"]
    view = bpy.context.view_layer.layer_collection.children[chain.name]
    assert view.hide_viewport
    view.hide_viewport = False
    bpy.context.view_layer.update()
    levels = [own.objects[0] for own in chain.children]
    for number, (level, share) in enumerate(zip(levels, [0.25, 0.0625]), 1):
        assert level.name == f"ball_LOD{number}" and level.parent == ball.parent, level.name
        assert abs(triangles(level) / triangles(ball) / share - 1) < 0.1, triangles(level)
        assert set(level.data.materials) == set(materials), list(level.data.materials)
        assert np.allclose(level.matrix_world, ball.matrix_world, atol=1e-5)
        boxes = np.array([level.bound_box, ball.bound_box])
        assert np.allclose(boxes[0], boxes[1], atol=0.1), boxes
        top = [own.material_index for own in level.data.polygons if own.center.z > 0.8]
        assert {level.data.materials[index].name for index in top} == {"skin.001"}
    after = {kind: set(getattr(bpy.data, kind).keys()) for kind in before}
    assert before == after, (before, after)
    assert not any("seamwise_source" in own for own in [ball, *materials, *levels])
    return levels


def hold_figures(ball, levels):
    levels[0].location.x += 5
    choose(*levels, ball)
    assert bpy.ops.object.seamwise_evaluate() == {"FINISHED"}
    figures = [own["seamwise_figures"].to_dict() for own in levels]
    assert figures[0]["distance_rms"] < figures[1]["distance_rms"] < 0.05, figures
    assert figures[0]["silhouette_iou"] > 0.95, figures
    assert levels[0].name in bpy.data.texts["Seamwise"].as_string()


def hold_own_materials(ball):
    choose(ball)
    bpy.ops.object.seamwise_bake(levels=1, ratio=0.25, evaluate=False, textures="repair")
    (level,) = bpy.data.collections["ball LOD1"].objects
    names = {own.name for own in level.data.materials}
    assert names == {"skin_LOD1", "skin.001_LOD1"}, names


def texels(image):
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return np.rint(values.reshape(SIDE, SIDE, 4) * 255).astype(int)


def hold_repair(ball):
    skin, bumps = bpy.data.images["skin"], bpy.data.images["bumps"]
    before = texels(skin)
    choose(ball)
    assert bpy.ops.object.seamwise_repair() == {"FINISHED"}
    after = texels(skin)
    inside = np.s_[8 : SIDE - 8, 8 : SIDE // 2 - 12]
    assert (before[inside] == after[inside]).all(), "valid texels have changed"
    magenta = (after == [255, 0, 255, 255]).all(axis=2).mean()
    assert magenta == 0, f"{magenta} of the texels is left of the background"
    assert np.abs(texels(bumps) - [128, 128, 255, 255]).max() <= 2, "normals have changed"
    assert skin.packed_file is not None


def hold_failures(ball):
    choose()
    assert "select the meshes" in told(bpy.ops.object.seamwise_bake)
    choose(ball)
    assert "select levels" in told(bpy.ops.object.seamwise_evaluate)
    ball.data.materials.clear()
    assert "no image" in told(bpy.ops.object.seamwise_repair)
    left = list(pathlib.Path(tempfile.gettempdir()).glob("seamwise-*/model.glb"))
    assert not left, left


def hold_ends(own):
    """A bake ends when it is told to, and what a program says when it fails is told."""
    with tempfile.TemporaryDirectory() as folder:
        options = {"ratios": [0.5], "textures": "keep", "evaluate": True, "reach_target": False}
        for end, expected in [("cancel", engine.Canceled), ("broken", engine.Failed)]:
            source = ROOT / "data/sample.glb"
            if end == "broken":
                source = pathlib.Path(folder) / "broken.glb"
                source.write_bytes(b"glTF and no more")
            job = Job(lambda watch, source=source: own.bake(str(source), folder, options, watch))
            job.watch.canceled = end == "cancel"
            job.run()
            assert type(job.error) is expected, repr(job.error)
        assert "broken.glb" in str(job.error), job.error
        assert not list(pathlib.Path(folder).glob("*_lod*")), "a canceled bake has left something"


def hold_rig():
    """The levels of a rigged mesh hang on its armature, not on one of their own."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.object.armature_add(location=(0, 3, 0))
    rig = bpy.context.object
    bpy.ops.mesh.primitive_cylinder_add(vertices=64, location=(0, 3, 0))
    limb = bpy.context.object
    limb.vertex_groups.new(name="Bone").add(range(len(limb.data.vertices)), 1.0, "REPLACE")
    limb.parent = rig
    limb.matrix_parent_inverse = rig.matrix_world.inverted()
    limb.modifiers.new("Armature", "ARMATURE").object = rig
    bpy.context.view_layer.update()
    choose(limb)
    assert bpy.ops.object.seamwise_bake(levels=1, ratio=0.5, evaluate=False) == {"FINISHED"}
    (level,) = bpy.data.collections[f"{limb.name} LOD1"].objects
    assert level.find_armature() == rig and len(bpy.data.armatures) == 1
    rig.pose.bones["Bone"].location.y = 2
    bpy.context.view_layer.layer_collection.children[0].hide_viewport = False
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    shown = [own.evaluated_get(graph) for own in (limb, level)]
    corners = [np.array([tuple(own.matrix_world @ vertex.co) for vertex in own.data.vertices]) for own in shown]
    assert corners[0][:, 1].min() > 1.9, "the bone moves nothing"
    for bound in (np.min, np.max):
        assert np.allclose(bound(corners[0], axis=0), bound(corners[1], axis=0), atol=0.02), corners


def main():
    logging.disable(logging.INFO)  # Blender's importer tells every step.
    tool = str(pathlib.Path(sys.argv[1]).resolve())
    engines = {"program": engine.Program(tool)}
    try:
        import seamwise

        engines["package"] = engine.Package(seamwise)
    except ImportError:
        print("skipped: the Python package is absent, so the add-on runs over the program alone")
    for name, own in engines.items():
        engine.find = lambda program="", own=own: own
        ball = make_scene()
        levels = hold_levels(ball)
        if own is list(engines.values())[-1]:  # This takes longest.
            hold_figures(ball, levels)
        hold_own_materials(ball)
        hold_repair(ball)
        hold_failures(ball)
        hold_ends(own)
        hold_rig()
        seamwise_blender.unregister()
        print(f"Blender {bpy.app.version_string}: the add-on does its work over the {name}")


main()
