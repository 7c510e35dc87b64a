# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Light Rig in the World properties, and what its buttons do."""

import math

import bpy

from . import light_rig
from .failure import Unsupported


class DOMELIGHT_OT_add_rig(bpy.types.Operator):
    """Extract the suns and lamps of the world's HDRI as lights, and leave the rest of its light in the world"""

    bl_idname = "domelight.add_rig"
    bl_label = "Add Light Rig"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.scene is not None and context.scene.world is not None

    def execute(self, context):
        try:
            n = light_rig.add(context.scene, context.scene.world)
        except Unsupported as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"The rig has {n} light{'s' if n != 1 else ''}")
        return {"FINISHED"}


class DOMELIGHT_OT_remove_rig(bpy.types.Operator):
    """Remove the lights of the rig, and give the world its HDRI again"""

    bl_idname = "domelight.remove_rig"
    bl_label = "Remove Light Rig"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.scene is not None and light_rig.has_rig(context.scene.world)

    def execute(self, context):
        light_rig.remove(context.scene.world)
        return {"FINISHED"}


class WORLD_PT_domelight_rig(bpy.types.Panel):
    """The panel in the World properties"""

    bl_label = "Light Rig"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.scene is not None and context.scene.world is not None

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        world = context.scene.world
        if not light_rig.has_rig(world):
            layout.prop(world.domelight, "sun")
            layout.prop(world.domelight, "lamps")
            layout.operator("domelight.add_rig", icon="LIGHT_SUN")
            return
        box = layout.box()
        rest = 1.0
        for light in light_rig.lights_of(world):
            rest -= light.data.domelight.share
            row(box, light.name, *described(light.data), icon="LIGHT_SUN")
        row(box, world.domelight.residual.name, f"{100 * rest:.1f} %", "", "", icon="IMAGE_DATA")
        layout.operator("domelight.remove_rig", icon="X")


def described(light):
    """A light's share, irradiance and angular diameter as text."""
    share, angle = 100 * light.domelight.share, math.degrees(light.angle)
    return f"{share:.1f} %", f"{light.energy:.3g} W/m²", f"{angle:.1f}°"


def row(box, name, *texts, icon):
    """A row of the list."""
    line = box.row()
    line.label(text=name, icon=icon)
    for text in texts:
        column = line.row()
        column.alignment = "RIGHT"
        column.label(text=text)


CLASSES = (DOMELIGHT_OT_add_rig, DOMELIGHT_OT_remove_rig, WORLD_PT_domelight_rig)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
