"""Images of materials as files, with the triangles whose UVs read them, and back."""

import json
import struct
import zlib

import bpy
import numpy as np

from .engine import Failed


class Atlas:
    """An image, how its texels are averaged, and the UVs of the corners of triangles that read it."""

    def __init__(self, image, role):
        self.image, self.role = image, role
        self.corners = []


def find(context, objects):
    """The images that these meshes read, and what is to be told of those that can't be repaired."""
    found, told = {}, []
    graph = context.evaluated_depsgraph_get()
    for own in objects:
        shown = own.evaluated_get(graph)
        mesh = shown.to_mesh()
        try:
            mesh.calc_loop_triangles()
            for index, slot in enumerate(own.material_slots):
                for node in _image_nodes(slot.material):
                    reason = _add(found, node, mesh, index)
                    if reason:
                        told.append(f"{node.image.name}: {reason}")
        finally:
            shown.to_mesh_clear()
    return list(found.values()), sorted(set(told))


def _image_nodes(material):
    nodes = material.node_tree.nodes if material and material.node_tree else ()
    return [node for node in nodes if node.type == "TEX_IMAGE" and node.image]


def _add(found, node, mesh, index):
    """Adds the triangles of a material that read an image; why not, if they can't be told."""
    image = node.image
    if image.source not in {"FILE", "GENERATED"}:
        return "tiles, movies and sequences are left alone"
    layer, reason = _layer(node, mesh)
    if reason:
        return reason
    count = len(mesh.loop_triangles)
    loops, materials = np.empty(3 * count, np.int32), np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("material_index", materials)
    uvs = np.empty(2 * len(mesh.loops), np.float32)
    layer.data.foreach_get("uv", uvs)
    corners = uvs.reshape(-1, 2)[loops.reshape(-1, 3)[materials == index].ravel()]
    if len(corners):
        atlas = found.setdefault(image.name, Atlas(image, _role(node)))
        atlas.corners.append(corners)
    return None


def _layer(node, mesh):
    """The UV map that an image is read by."""
    links = node.inputs["Vector"].links
    layers = mesh.uv_layers
    active = next((own for own in layers if own.active_render), None)
    if not links:
        return (active, None) if active else (None, "the mesh has no UV map")
    origin = links[0].from_node
    if origin.type == "UVMAP":
        layer = layers.get(origin.uv_map) if origin.uv_map else active
        return (layer, None) if layer else (None, f"the mesh has no UV map {origin.uv_map!r}")
    if origin.type == "TEX_COORD" and links[0].from_socket.name == "UV" and active:
        return active, None
    return None, f"its coordinates come from {origin.name!r}, not from a UV map alone"


def _role(node):
    if not node.image.colorspace_settings.is_data:
        return "color"
    followers = {link.to_node.type for link in node.outputs["Color"].links}
    return "normal" if "NORMAL_MAP" in followers else "data"


def write(atlas, folder):
    """Writes the image, and a mesh with its UVs; the two files."""
    image, mesh = folder / f"atlas{'.exr' if atlas.image.is_float else '.png'}", folder / "charts.glb"
    if not atlas.image.has_data and not atlas.image.size[0]:
        raise Failed(f"{atlas.image.name} has no pixels: is its file there?")
    if atlas.image.is_float:
        _write_floats(atlas.image, image)
    else:
        _write_png(image, _texels(atlas.image))
    _write_mesh(mesh, np.concatenate(atlas.corners))
    return image, mesh


def _texels(image):
    """The stored values, the top row first."""
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], image.channels)[::-1]


def _write_floats(image, path):
    kind = image.file_format
    image.file_format = "OPEN_EXR"
    try:
        image.save(filepath=str(path), save_copy=True)
    finally:
        image.file_format = kind


def _write_png(path, texels):
    height, width, channels = texels.shape
    texels = np.rint(texels * 255).astype(np.uint8)
    rows = np.concatenate([np.zeros((height, 1), np.uint8), texels.reshape(height, -1)], axis=1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    chunks = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows.tobytes(), 1)), chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def _write_mesh(path, uvs):
    """A flat .glb of triangles that lie where their UVs do; glTF counts v from the top."""
    uvs = np.column_stack([uvs[:, 0], 1 - uvs[:, 1]]).astype("<f4")
    positions = np.column_stack([uvs, np.zeros(len(uvs), "<f4")]).astype("<f4")
    binary = positions.tobytes() + uvs.tobytes()
    low, high = positions.min(axis=0).tolist(), positions.max(axis=0).tolist()
    split = positions.nbytes
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(uvs), "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": 5126, "count": len(uvs), "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": split},
            {"buffer": 0, "byteOffset": split, "byteLength": len(binary) - split},
        ],
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(binary)
    header = struct.pack("<4sIIII", b"glTF", 2, size, len(text), 0x4E4F534A)
    path.write_bytes(header + text + struct.pack("<II", len(binary), 0x004E4942) + binary)


def read_back(atlas, path):
    """Puts the texels of a file into the image, which stays packed if it was."""
    image = atlas.image
    loaded = bpy.data.images.load(str(path))
    try:
        loaded.colorspace_settings.name = image.colorspace_settings.name
        loaded.alpha_mode = image.alpha_mode
        values = np.empty(len(loaded.pixels), np.float32)
        loaded.pixels.foreach_get(values)
        values = values.reshape(-1, loaded.channels)[:, : image.channels]
        image.pixels.foreach_set(np.ascontiguousarray(values).ravel())
    finally:
        bpy.data.images.remove(loaded)
    image.update()
    if image.packed_file:
        image.pack()
