"""Seamwise in Blender: Object > Seamwise > Bake levels, Repair atlas, Evaluate.

The work is done by the Python package `seamwise` if Blender's Python has it, else by the program.
"""

import bpy

from . import operators

bl_info = {
    "name": "Seamwise",
    "description": "Levels of detail that keep their textures, and atlases that do not bleed",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "Object > Seamwise",
    "category": "Object",
}


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: bpy.props.StringProperty(
        name="Program",
        description="The program seamwise, to be used in the place of the Python package",
        subtype="FILE_PATH",
    )

    def draw(self, _context):
        self.layout.prop(self, "program")


class Menu(bpy.types.Menu):
    bl_idname = "VIEW3D_MT_seamwise"
    bl_label = "Seamwise"

    def draw(self, _context):
        # A dialog of options comes first.
        self.layout.operator_context = "INVOKE_DEFAULT"
        for operator in operators.ALL:
            self.layout.operator(operator.bl_idname)


def _draw(self, _context):
    self.layout.menu(Menu.bl_idname)


_CLASSES = (Preferences, Menu, *operators.ALL)


def register():
    for own in _CLASSES:
        bpy.utils.register_class(own)
    bpy.types.VIEW3D_MT_object.append(_draw)


def unregister():
    bpy.types.VIEW3D_MT_object.remove(_draw)
    for own in reversed(_CLASSES):
        bpy.utils.unregister_class(own)
