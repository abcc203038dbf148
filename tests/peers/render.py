#!/usr/bin/env python3
"""Holds the renderer of `seamwise evaluate` against Mitsuba 3, a ray tracer.

From the same cameras, which the evaluator's report names, are compared

- coverage: the share of each pixel that an asset covers. Ours from the sheet's picture of a copy of
  it that is white all over, on the gray background;
- base color: `--unlit` against Mitsuba's albedo, both encoded as sRGB;
- the Lambert part of the light, linear: ours as the difference between a copy that is gray all
  over and one that is black, since what a dielectric mirrors is the same in both. On assets
  against the documented light (src/evaluate/light.rs) on Mitsuba's shading normals, since ours
  casts no shadows; on a sphere, which has none, against Mitsuba's own light transport.

Each figure is a mean absolute difference over the pixels that either of the two covers, and must
be below 0.01.

What differs by design: ours has 2 × 2 samples a pixel in fixed places and reads trilinear mip maps
as wide as a pixel's longer side, while Mitsuba averages many samples of the texture itself. So
print on a box is softer in ours where it is seen small or aslant: 0.013 to 0.023 in base color at
256 pixels, 0.007 to 0.011 at 512. To hold apart what is filtering and what is not, each asset is
compared at 256 pixels with its texture reduced, so that mip maps are read only where it is seen
aslant, and once at 1024 pixels with its texture whole. The sheet's 8 bits add about 0.001.

Needs Python 3.11 or later with venv, the assets in ../shared/assets (the sphere goes without), and,
on the first run, the network: it makes its own environment (see setting.py). Takes about two
minutes once that is there. Exits with 1 if a limit is broken.
"""

import sys

import setting

setting.enter_environment()

import mitsuba as mi
import numpy as np

import gltf

# The vectorized variants need an LLVM that suits the machine, and abort where it does not.
mi.set_variant("scalar_rgb")

ASSETS = ["scan/popcorn.glb", "scan/frypan.glb"]
# Texels along each side of a reduced texture. A box seen aslant differs by 0.012, 0.0055 and 0.0026
# with 256, 128 and 64.
REDUCED = 128
LIMIT = 0.01

# The light and the background, as src/evaluate/light.rs and render.rs document them.
KEY, SKY, GROUND = 0.55, 0.45, 0.15
KEY_DIRECTION = (-0.4, 0.6, -1.0)  # to the key: right, up, forward
DIELECTRIC = 0.04
BACKGROUND = 0.21404114
GAP = 4  # pixels between the pictures of a sheet
GRAY = 0.8


def to_linear(srgb):
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def recolored(path, document, color):
    """A copy of an asset whose materials are dielectric and of one color."""
    material = {
        "baseColorFactor": [*[color] * 3, 1],
        "metallicFactor": 0,
        "roughnessFactor": 1,
    }
    plain = {"name": "plain", "pbrMetallicRoughness": material}
    count = len(document.json["materials"])
    changed = gltf.Document(document.json | {"materials": [plain] * count}, document.buffers)
    return changed.write(path)


class Ours:
    """Pictures of an asset and of plain copies of it."""

    def __init__(self, tool, path, views, resolution):
        document = gltf.Document.read(path)
        colors = {"white": 1, "gray": GRAY, "black": 0}
        copies = [recolored(tool.folder / f"{n}.glb", document, c) for n, c in colors.items()]
        sheet = tool.folder / "sheet.png"
        draw = lambda *options: tool.evaluate(
            path, copies, "--views", views, "--resolution", resolution, "--samples", 1000,
            "--sheet", sheet, "--sheet-views", views, *options,
        )  # fmt: skip
        self.views = draw("--unlit")["views"]
        own, white, _, _ = read_sheet(sheet, views, resolution)
        self.colors = own
        self.coverages = (to_linear(white).mean(-1) - BACKGROUND) / (1 - BACKGROUND)
        draw()
        _, _, gray, black = read_sheet(sheet, views, resolution)
        self.lambert = (to_linear(gray) - to_linear(black)).mean(-1) / GRAY


def read_sheet(path, views, side):
    """Per column its pictures without the differences below them: views × side × side × 3."""
    pixels = np.array(mi.Bitmap(str(path)))[..., :3] / 255.0
    head = 6 + 8 * max(1, side // 256)  # above each, for its name
    width, height = side + GAP, side + GAP + head
    columns = (pixels.shape[1] - GAP) // width
    at = lambda row, column: pixels[GAP + head + row * height :, GAP + column * width :][:side, :side]
    return [np.stack([at(2 * v, c) for v in range(views)]) for c in range(columns)]


class Mitsuba:
    """The same pictures by Mitsuba."""

    def __init__(self, shapes, camera, size, samples):
        """`shapes`: Mitsuba's dictionaries by name; `size`: pixels along each side."""
        self.shapes = shapes
        self.size = size
        film = {
            "type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"},
            "pixel_format": "rgba", "component_format": "float32",
        }  # fmt: skip
        look = {"origin": camera["eye"], "target": camera["target"], "up": camera["up"]}
        self.sensor = {
            "type": "perspective",
            "fov": camera["field_of_view_degrees"],
            "to_world": mi.ScalarTransform4f().look_at(**look),
            "film": film,
            "sampler": {"type": "multijitter", "sample_count": samples},
        }

    def render(self, integrator, **emitters):
        scene = {"type": "scene", "sensor": self.sensor, "integrator": integrator}
        return np.array(mi.render(mi.load_dict(scene | self.shapes | emitters)))

    def see(self):
        """Coverage, and albedo and shading normal weighted by it."""
        direct = {"type": "direct", "hide_emitters": True}
        aovs = {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "image": direct}
        pixels = self.render(aovs)
        return pixels[..., 3], pixels[..., 4:7], pixels[..., 7:10]


def asset_shapes(tool, path):
    """The shapes of an asset with its base color textures, for Mitsuba."""
    document = gltf.Document.read(path)
    shapes = {}
    for index, surface in enumerate(document.surfaces()):
        pbr = document.json["materials"][surface.material]["pbrMetallicRoughness"]
        assert set(pbr.get("baseColorFactor", [1])) == {1}, "a factor is not handled here"
        picture = tool.folder / f"{path.stem}{index}.png"
        picture.write_bytes(document.image(pbr["baseColorTexture"]["index"]))
        texture = {"type": "bitmap", "filename": str(picture), "format": "variant"}
        mesh = tool.folder / f"{path.stem}{index}.ply"
        write_ply(mesh, surface)
        diffuse = {"type": "diffuse", "reflectance": texture}
        shapes[f"shape{index}"] = {"type": "ply", "filename": str(mesh), "bsdf": diffuse}
    return shapes


def write_ply(path, surface):
    names = "x y z nx ny nz u v".split()
    vertices = np.hstack([surface.positions, surface.normals, surface.uvs]).astype("<f4")
    faces = np.empty(len(surface.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, surface.triangles
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property float {name}" for name in names]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    path.write_bytes("\n".join(lines).encode() + b"\n" + vertices.tobytes() + faces.tobytes())


def key_direction(camera):
    """Unit, from the scene to the key."""
    eye, target, up = (np.array(camera[name]) for name in ("eye", "target", "up"))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right, upward, onward = KEY_DIRECTION
    direction = right * np.cross(forward, up) + upward * up + onward * forward
    return direction / np.linalg.norm(direction)


def documented_lambert(normals, camera):
    """What white sends by the light's formula, for unit normals; the key less what is mirrored."""
    around = GROUND + (SKY - GROUND) * (0.5 + 0.5 * normals[..., 1])
    return around + KEY * (1 - DIELECTRIC) * (normals @ key_direction(camera)).clip(0)


def traced_lambert(peer, camera):
    """What white sends of the same light, traced."""
    sky = np.full((512, 1024, 3), SKY, np.float32)
    sky[256:] = GROUND
    # By the surface's own distribution: each sample is worth what it hits.
    surrounding = {"type": "direct", "emitter_samples": 0, "bsdf_samples": 1, "hide_emitters": True}
    around = peer.render(surrounding, sky={"type": "envmap", "bitmap": mi.Bitmap(sky)})
    irradiance = np.pi * KEY * (1 - DIELECTRIC)
    key = {
        "type": "directional",
        "direction": (-key_direction(camera)).tolist(),
        "irradiance": {"type": "rgb", "value": [irradiance] * 3},
    }
    lit = peer.render({"type": "direct", "hide_emitters": True}, key=key)
    return (around + lit)[..., :3].mean(-1)


class Table:
    """Prints the figures, and remembers whether one broke its limit."""

    def __init__(self):
        self.failures = 0
        print(f"{'':16}{'pixels':>7}{'view':>6}{'coverage':>10}{'base color':>12}{'Lambert':>10}")

    def add(self, name, resolution, view, figures):
        broken = any(not figure < LIMIT for figure in figures if figure is not None)
        self.failures += broken
        cells = ["" if figure is None else f"{figure:.4f}" for figure in figures]
        line = f"{name:16}{resolution:7}{view:6}{cells[0]:>10}{cells[1]:>12}{cells[2]:>10}"
        print(f"{line}{'  broken' if broken else ''}", flush=True)


def difference(a, b, covered):
    return float(np.abs(a - b)[covered].mean())


def shrink(pixels, side):
    """A picture of fewer pixels, each the mean of a square of them."""
    size = pixels.shape[0] // side
    return pixels.reshape(side, size, side, size, *pixels.shape[2:]).mean((1, 3))


def reduce_texture(tool, path):
    """A copy of an asset of one texture, with that reduced; any way will do, as both see it."""
    document = gltf.Document.read(path)
    picture = tool.folder / "whole.png"
    picture.write_bytes(document.image(0))
    texels = np.array(mi.Bitmap(str(picture)))[..., :3].astype(np.float64)
    reduced = shrink(texels, REDUCED).round().astype(np.uint8)
    mi.Bitmap(reduced).write(str(tool.folder / "reduced.png"))
    changed = gltf.Document(document.json | {"images": [{"uri": "reduced.png"}]}, document.buffers)
    return changed.write(tool.folder / f"{path.stem}-reduced.glb")


def compare_asset(tool, table, path, views, resolution, finer):
    """`finer`: pixels of Mitsuba's along each side of a pixel of the comparison."""
    ours = Ours(tool, path, views, resolution)
    shapes = asset_shapes(tool, path)
    for view, camera in enumerate(ours.views):
        # Larger, so that the light is seen of each normal and not of their mean.
        peer = Mitsuba(shapes, camera, finer * resolution, samples=4)
        coverage, albedo, normal = peer.see()
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        lambert = documented_lambert(normal / np.maximum(length, 1e-9), camera) * coverage
        coverage, albedo, lambert = (shrink(p, resolution) for p in (coverage, albedo, lambert))
        color = to_srgb(albedo + (1 - coverage[..., None]) * BACKGROUND)
        covered = (coverage > 0) | (ours.coverages[view] > 0.01)
        figures = (
            difference(coverage, ours.coverages[view], covered),
            difference(color, ours.colors[view], covered),
            difference(lambert, ours.lambert[view], covered),
        )
        table.add(path.stem, resolution, view, figures)


def compare_sphere(tool, table, resolution=256, side=128):
    polar, around = np.meshgrid(
        np.linspace(0, np.pi, side + 1), np.linspace(0, 2 * np.pi, 2 * side + 1), indexing="ij"
    )
    ring = np.sin(polar)
    points = np.stack([ring * np.sin(around), np.cos(polar), ring * np.cos(around)], -1)
    points = points.reshape(-1, 3)
    path = tool.folder / "ball.glb"
    gltf.build(points, gltf.grid(side, 2 * side), points, {"name": "plain"}).write(path)
    ours = Ours(tool, path, 1, resolution)
    white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [1.0] * 3}}
    camera = ours.views[0]
    peer = Mitsuba({"ball": {"type": "sphere", "bsdf": white}}, camera, resolution, samples=256)
    coverage, _, _ = peer.see()
    covered = (coverage > 0) | (ours.coverages[0] > 0.01)
    lambert = difference(traced_lambert(peer, camera), ours.lambert[0], covered)
    seen = difference(coverage, ours.coverages[0], covered)
    table.add("sphere", resolution, 0, (seen, None, lambert))


def add_options(parser):
    parser.add_argument(
        "--views", type=int, choices=range(1, 25), default=3, metavar="1…24",
        help="cameras of the rig that see the reduced textures; 3 if not given",
    )  # fmt: skip


def main():
    tool = setting.Tool(__doc__, add_options)
    print(f"Mean absolute differences to Mitsuba {mi.__version__} ({mi.variant()})\n")
    table = Table()
    compare_sphere(tool, table)
    for asset in setting.find_assets(ASSETS):
        reduced = reduce_texture(tool, asset)
        compare_asset(tool, table, reduced, tool.options.views, resolution=256, finer=4)
        compare_asset(tool, table, asset, 1, resolution=1024, finer=2)
    print(f"\n{table.failures} pictures beyond the limit" if table.failures else f"\nAll below {LIMIT}")
    sys.exit(table.failures > 0)


if __name__ == "__main__":
    main()
