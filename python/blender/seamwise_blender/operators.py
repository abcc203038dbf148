"""The operators of the menu."""

import shutil
import tempfile
from pathlib import Path

import bpy

from . import atlas, engine, exchange
from .engine import Failed
from .work import Work


class OnMeshes(Work):
    """What the operators share: the engine, the selected meshes and a folder for files."""

    bl_options = {"REGISTER", "UNDO"}
    folder = None

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def engine(self, context):
        addon = context.preferences.addons.get(__package__)
        return engine.find(bpy.path.abspath(addon.preferences.program) if addon else "")

    def meshes(self, context):
        """The selected meshes, the active one first."""
        chosen = [own for own in context.selected_objects if own.type == "MESH" and own.data.polygons]
        if not chosen:
            raise Failed("select the meshes that it is for")
        active = context.view_layer.objects.active
        return sorted(chosen, key=lambda own: own != active)

    def temporary(self):
        self.folder = Path(tempfile.mkdtemp(prefix="seamwise-"))
        return self.folder

    def clean(self):
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


class BakeLevels(OnMeshes, bpy.types.Operator):
    """Make levels of detail of the selected meshes, each in a collection of its own"""

    bl_idname = "object.seamwise_bake"
    bl_label = "Bake levels"

    levels: bpy.props.IntProperty(name="Levels", default=4, min=1, max=16)
    ratio: bpy.props.FloatProperty(
        name="Ratio",
        description="Triangles of a level, as a share of those of the finer one",
        default=0.5,
        min=0.01,
        max=0.99,
    )
    textures: bpy.props.EnumProperty(
        name="Textures",
        items=[
            ("keep", "Keep", "Levels wear the very materials of their source"),
            ("repair", "Repair", "Materials of their own, with the texels filled that no chart covers"),
            ("transfer", "Transfer", "Materials of their own, with every texel sampled anew from the source"),
        ],
        default="keep",
    )
    evaluate: bpy.props.BoolProperty(
        name="Evaluate", description="Measure how large each level may be shown", default=True
    )
    reach_target: bpy.props.BoolProperty(
        name="Reach target", description="Take triangles away even where that destroys the shape"
    )

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def prepare(self, context):
        own, meshes = self.engine(context), self.meshes(context)
        folder = self.temporary()
        self.chain = meshes[0].name
        source = folder / "model.glb"
        exchange.write(context, meshes, source)
        options = {
            "ratios": [self.ratio**level for level in range(1, self.levels + 1)],
            "textures": self.textures,
            "evaluate": self.evaluate,
            "reach_target": self.reach_target,
        }
        return lambda watch: own.bake(str(source), str(folder / "out"), options, watch)

    def finish(self, context, report):
        exchange.remove_levels(context, self.chain)
        out = self.folder / "out"
        files = [out / f"model_lod{level + 1}.glb" for level in range(len(report["levels"]))]
        collections = exchange.read_levels(context, self.chain, files, self.textures == "keep")
        for collection, level in zip(collections, report["levels"]):
            collection["seamwise_triangles"] = level["triangles"]
            if level.get("largest_size_pixels"):
                collection["seamwise_largest_size_pixels"] = level["largest_size_pixels"]
            if not level["reached"]:
                why = level["why"] or "its target was not reached"
                self.report({"WARNING"}, f"{collection.name}: {level['triangles']:,} triangles: {why}")
        counts = ", ".join(f"{level['triangles']:,}" for level in report["levels"])
        source = f"{report['input']['triangles']:,}"
        self.report({"INFO"}, f"levels of {source} triangles have {counts}; their collection is hidden")


class RepairAtlas(OnMeshes, bpy.types.Operator):
    """Fill the texels of the selected meshes' images that no UV triangle of theirs covers"""

    bl_idname = "object.seamwise_repair"
    bl_label = "Repair atlas"

    def prepare(self, context):
        own, meshes = self.engine(context), self.meshes(context)
        self.atlases, told = atlas.find(context, meshes)
        for line in told:
            self.report({"WARNING"}, line)
        if not self.atlases:
            raise Failed("no image of the selected meshes can be repaired" + "".join(f"; {line}" for line in told))
        folder, jobs = self.temporary(), []
        for index, item in enumerate(self.atlases):
            place = folder / str(index)
            place.mkdir()
            image, mesh = atlas.write(item, place)
            jobs.append((str(image), str(place / f"repaired{image.suffix}"), str(mesh), item.role))

        def work(watch):
            return [(job[1], own.repair(*job, watch)) for job in jobs]

        return work

    def finish(self, _context, results):
        for item, (output, report) in zip(self.atlases, results):
            filled = sum(image["filled"] for image in report["images"])
            atlas.read_back(item, output)
            self.report({"INFO"}, f"{item.image.name}: {filled:,} texels filled; save the image to keep them")


class Evaluate(OnMeshes, bpy.types.Operator):
    """Compare the other selected meshes with the active one, which they are levels of"""

    bl_idname = "object.seamwise_evaluate"
    bl_label = "Evaluate"

    def prepare(self, context):
        own, meshes = self.engine(context), self.meshes(context)
        if len(meshes) < 2 or meshes[0] != context.view_layer.objects.active:
            raise Failed("select levels, and last the mesh that they are compared with")
        folder = self.temporary()
        files = [folder / f"{index}.glb" for index in range(len(meshes))]
        for mesh, file in zip(meshes, files):
            with exchange.placed_like(context, mesh, meshes[0]):
                exchange.write(context, [mesh], file)
        self.names = [mesh.name for mesh in meshes]
        reference, *candidates = map(str, files)
        return lambda watch: own.evaluate(reference, candidates, watch)

    def finish(self, _context, figures):
        lines = [f"Compared with {self.names[0]}; distances are shares of its bounding box's diagonal", ""]
        for name, own in zip(self.names[1:], figures):
            bpy.data.objects[name]["seamwise_figures"] = {
                key: value for key, value in own.items() if isinstance(value, (int, float))
            }
            size = (own.get("at_switch") or {}).get("pixels")
            shown = f"looks the same below {size:,.0f} px" if size else "looks the same at any size"
            line = f"{name}: {shown}, luminance {own['rms_luminance_srgb']:.4f}, distance {own['distance_rms']:.2e}"
            lines.append(line)
            self.report({"INFO"}, line)
        text = bpy.data.texts.get("Seamwise") or bpy.data.texts.new("Seamwise")
        text.from_string("\n".join(lines) + "\n")


ALL = (BakeLevels, RepairAtlas, Evaluate)
