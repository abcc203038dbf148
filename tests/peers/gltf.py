"""As much of glTF as the comparisons need, read and written without the project's own code.

Not read: sparse accessors, skins, strips and fans, images outside the file's folder. What is not
read is refused, so that a peer never sees less than the evaluator.
"""

import base64
import json
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
COMPONENTS = {
    5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32,
    5126: np.float32,
}  # fmt: skip
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass
class Surface:
    """Triangles of one material in world space."""

    positions: np.ndarray  # vertices × 3, float32
    triangles: np.ndarray  # triangles × 3, vertex indices, counter-clockwise from outside
    normals: np.ndarray | None  # vertices × 3, unit
    uvs: np.ndarray | None  # vertices × 2, v downward from the image's top
    material: int | None


class Document:
    """A glTF file: its JSON and its buffers."""

    def __init__(self, document, buffers, folder=None):
        self.json = document
        self.buffers = buffers
        self.folder = folder

    @classmethod
    def read(cls, path):
        path = Path(path)
        data = path.read_bytes()
        binary = b""
        if data[:4] == b"glTF":
            (length,) = struct.unpack_from("<I", data, 12)
            document = json.loads(data[20 : 20 + length])
            binary = data[28 + length :]
        else:
            document = json.loads(data)
        buffers = []
        for buffer in document.get("buffers", []):
            uri = buffer.get("uri")
            content = binary if uri is None else load_uri(path.parent, uri)
            buffers.append(content[: buffer["byteLength"]])
        return cls(document, buffers, path.parent)

    def write(self, path):
        """Writes a .glb; the document must have one buffer."""
        (binary,) = self.buffers
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        binary += b"\0" * (-len(binary) % 4)
        chunks = struct.pack("<II", len(text), JSON_CHUNK) + text
        chunks += struct.pack("<II", len(binary), BINARY_CHUNK) + binary
        Path(path).write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
        return path

    def surfaces(self):
        """The triangles of the default scene."""
        scene = self.json["scenes"][self.json.get("scene", 0)]
        found = []
        for root in scene["nodes"]:
            self._visit(root, np.eye(4), found)
        return found

    def image(self, texture):
        """The encoded bytes of a texture's image."""
        image = self.json["images"][self.json["textures"][texture]["source"]]
        if "bufferView" in image:
            view = self.json["bufferViews"][image["bufferView"]]
            start = view.get("byteOffset", 0)
            return self.buffers[view["buffer"]][start : start + view["byteLength"]]
        return load_uri(self.folder, image["uri"])

    def _visit(self, index, parent, found):
        node = self.json["nodes"][index]
        world = parent @ local_transform(node)
        if "mesh" in node:
            if "skin" in node:
                raise ValueError(f"node {index} has a skin")
            for primitive in self.json["meshes"][node["mesh"]]["primitives"]:
                found.append(self._surface(primitive, world))
        for child in node.get("children", []):
            self._visit(child, world, found)

    def _surface(self, primitive, world):
        if primitive.get("mode", 4) != 4:
            raise ValueError(f"a primitive of mode {primitive['mode']}")
        attributes = primitive["attributes"]
        read = lambda name: self._accessor(attributes[name]) if name in attributes else None
        positions = read("POSITION").astype(np.float64)
        if "indices" in primitive:
            triangles = self._accessor(primitive["indices"]).reshape(-1, 3).astype(np.int64)
        else:
            triangles = np.arange(len(positions)).reshape(-1, 3)
        linear = world[:3, :3]
        if np.linalg.det(linear) < 0:
            triangles = triangles[:, [0, 2, 1]]
        normals = read("NORMAL")
        if normals is not None:
            normals = normals @ np.linalg.inv(linear)
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        placed = (positions @ linear.T + world[:3, 3]).astype(np.float32)
        return Surface(
            placed, triangles, normals, read("TEXCOORD_0"), primitive.get("material")
        )

    def _accessor(self, index):
        accessor = self.json["accessors"][index]
        if "sparse" in accessor or accessor.get("normalized"):
            raise ValueError(f"accessor {index} is sparse or normalized")
        view = self.json["bufferViews"][accessor["bufferView"]]
        kind = np.dtype(COMPONENTS[accessor["componentType"]]).newbyteorder("<")
        width = WIDTHS[accessor["type"]]
        size = kind.itemsize * width
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride = view.get("byteStride", size)
        rows = np.ndarray(
            (accessor["count"], width), kind, self.buffers[view["buffer"]], start,
            (stride, kind.itemsize),
        )  # fmt: skip
        return np.ascontiguousarray(rows)


def load_uri(folder, uri):
    if uri.startswith("data:"):
        return base64.b64decode(uri.split(",", 1)[1])
    return (folder / uri).read_bytes()


def local_transform(node):
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    rotation = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    transform = np.eye(4)
    transform[:3, :3] = rotation * np.array(node.get("scale", [1, 1, 1]))
    transform[:3, 3] = node.get("translation", [0, 0, 0])
    return transform


def build(positions, triangles, normals=None, material=None):
    """A document of one mesh."""
    parts = [("POSITION", np.asarray(positions, np.float32), 5126, "VEC3")]
    if normals is not None:
        parts.append(("NORMAL", np.asarray(normals, np.float32), 5126, "VEC3"))
    parts.append(("indices", np.asarray(triangles, np.uint32).reshape(-1), 5125, "SCALAR"))
    binary, views, accessors, names = b"", [], [], {}
    for name, rows, component, kind in parts:
        names[name] = len(accessors)
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": rows.nbytes})
        accessor = {"componentType": component, "count": len(rows), "type": kind}
        if name == "POSITION":
            accessor |= {"min": rows.min(0).tolist(), "max": rows.max(0).tolist()}
        accessors.append({"bufferView": len(views) - 1, **accessor})
        binary += rows.tobytes()
    primitive = {"indices": names.pop("indices"), "attributes": names}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    if material is not None:
        primitive["material"] = 0
        document["materials"] = [material]
    return Document(document, [binary])


def grid(rows, columns):
    """The triangles of a grid of rows × columns cells."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    a = row * (columns + 1) + column
    b, c, d = a + columns + 1, a + columns + 2, a + 1
    return np.stack([a, b, c, a, c, d], -1).reshape(-1, 3)
