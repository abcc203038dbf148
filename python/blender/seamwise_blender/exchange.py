"""Models to files, and levels back as collections that wear the materials they had."""

import contextlib

import bpy

# Goes out with every object and material in its extras and comes back with the levels, since names do
# not: Blender changes those that are taken.
TAG = "seamwise_source"
# Name of the source, at the collection of its levels.
LEVELS = "seamwise_levels"
KINDS = ("objects", "meshes", "materials", "images", "armatures", "actions", "collections")


@contextlib.contextmanager
def _selected(context, objects):
    """Selects these objects alone, for as long as it lasts."""
    layer = context.view_layer
    before, active = list(context.selected_objects), layer.objects.active
    _select(layer, objects)
    try:
        yield
    finally:
        _select(layer, before)
        layer.objects.active = active


def _select(layer, objects):
    # Objects that were removed are in the list until then.
    layer.update()
    for own in layer.objects:
        own.select_set(own in objects)


@contextlib.contextmanager
def _tagged(objects):
    """Writes their names to objects and materials."""
    slots = [slot.material for own in objects for slot in own.material_slots if slot.material]
    tagged = [*objects, *slots]
    for own in tagged:
        own[TAG] = own.name
    try:
        yield
    finally:
        for own in tagged:
            if TAG in own:
                del own[TAG]


@contextlib.contextmanager
def placed_like(context, own, other):
    """Puts an object where another is, since levels are often moved aside to be looked at."""
    place = own.matrix_world.copy()
    if own.find_armature() is None:
        own.matrix_world = other.matrix_world
    context.view_layer.update()
    try:
        yield
    finally:
        if own.find_armature() is None:
            own.matrix_world = place


def write(context, objects, path):
    """Writes meshes, with the armatures that move them, as they are shown."""
    rigs = {own.find_armature() for own in objects} - {None}
    # A modifier's mesh has no shape keys.
    applies = not any(own.data.shape_keys for own in objects)
    with _selected(context, [*objects, *rigs]), _tagged(objects):
        bpy.ops.export_scene.gltf(
            filepath=str(path),
            export_format="GLB",
            use_selection=True,
            export_apply=applies,
            export_extras=True,
            export_animations=False,
        )


def remove_levels(context, name):
    """Removes the levels that an earlier bake of this name has left."""
    for chain in [own for own in bpy.data.collections if own.get(LEVELS) == name]:
        for own in list(chain.all_objects):
            _remove_with_mesh(own)
        for own in [*chain.children_recursive, chain]:
            bpy.data.collections.remove(own)
    context.view_layer.update()


def _remove_with_mesh(own):
    data = own.data
    bpy.data.objects.remove(own)
    if data is not None and not data.users and isinstance(data, bpy.types.Mesh):
        bpy.data.meshes.remove(data)


def read_levels(context, name, files, keep_materials):
    """A collection of a collection for each level, out of sight until somebody wants it."""
    chain = bpy.data.collections.new(f"{name} levels")
    chain[LEVELS] = name
    context.scene.collection.children.link(chain)
    levels = []
    for number, file in enumerate(files, 1):
        level = bpy.data.collections.new(f"{name} LOD{number}")
        chain.children.link(level)
        _read_level(context, level, file, number, keep_materials)
        levels.append(level)
    view = context.view_layer.layer_collection.children[chain.name]
    view.hide_viewport = True
    chain.hide_render = True
    return levels


def _read_level(context, level, file, number, keep_materials):
    before = {kind: set(getattr(bpy.data, kind)) for kind in KINDS}
    with _selected(context, []):
        bpy.ops.import_scene.gltf(filepath=str(file))
        new = [own for own in bpy.data.objects if own not in before["objects"]]
        meshes = [own for own in new if own.type == "MESH" and TAG in own]
        context.view_layer.update()
        places = [own.matrix_world.copy() for own in meshes]
        for own, place in zip(meshes, places):
            source = bpy.data.objects[own[TAG]]
            _follow(own, source, place)
            own.name = f"{source.name}_LOD{number}"
            own.data.name = own.name
            for slot in own.material_slots if keep_materials else ():
                slot.material = bpy.data.materials[slot.material[TAG]] if slot.material else None
            del own[TAG]
            for collection in own.users_collection:
                collection.objects.unlink(own)
            level.objects.link(own)
        for own in set(new) - set(meshes):
            bpy.data.objects.remove(own)
    for kind in KINDS[1:]:
        for own in set(getattr(bpy.data, kind)) - before[kind]:
            if own.users == 0:
                getattr(bpy.data, kind).remove(own)
            elif kind == "materials":
                own.name = f"{own.pop(TAG, own.name)}_LOD{number}"


def _follow(own, source, place):
    """Lets a level be moved by what moves its source."""
    rig = source.find_armature()
    if rig is not None:
        for modifier in own.modifiers:
            if modifier.type == "ARMATURE":
                modifier.object = rig
        # Its vertices are in the space of the armature.
        own.parent = rig
        return
    own.parent = source.parent
    own.parent_type = source.parent_type
    own.parent_bone = source.parent_bone
    own.matrix_world = place
