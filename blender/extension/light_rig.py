# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light rig of a world: its suns and lamps as lights, and the rest of its light in its picture.

Adding a rig changes one thing of the world: its Environment Texture shows the residual picture. The suns are children of
an empty that drivers turn with the world, and drivers give them the world's strength.
"""

import bpy
import domelight as dl
import numpy as np
from mathutils import Vector

from . import pixels
from .failure import Unsupported
from .orientation import BLENDER_FROM_Z_UP, color_and_strength, facing_disc
from .world import require_picture, world_light

NAME = "Light Rig"


class LightRigLight(bpy.types.PropertyGroup):
    """What a light of a rig holds."""

    is_rig: bpy.props.BoolProperty(options={"HIDDEN"})
    # Of the world's luminance, in [0, 1].
    share: bpy.props.FloatProperty(options={"HIDDEN"})


class LightRigWorld(bpy.types.PropertyGroup):
    """The rig of a world, and how to make one."""

    sun: bpy.props.BoolProperty(name="Sun", default=True, description="Extract the sun as one light")
    lamps: bpy.props.IntProperty(
        name="Lamps",
        default=4,
        min=0,
        soft_max=16,
        max=256,
        description="The most other bright sources, such as lamps and windows, to extract",
    )
    # The picture that the rig replaced; none without a rig.
    original: bpy.props.PointerProperty(type=bpy.types.Image, options={"HIDDEN"})
    residual: bpy.props.PointerProperty(type=bpy.types.Image, options={"HIDDEN"})
    collection: bpy.props.PointerProperty(type=bpy.types.Collection, options={"HIDDEN"})


def has_rig(world):
    """Whether a world has a rig."""
    return world is not None and world.domelight.original is not None


def lights_of(world):
    """The objects of a rig's lights, brightest first."""
    collection = world.domelight.collection
    lights = [o for o in collection.objects if o.type == "LIGHT" and o.data.domelight.is_rig] if collection else []
    return sorted(lights, key=lambda light: -light.data.domelight.share)


def add(scene, world):
    """Extract a rig from the world's picture, and return its number of lights. Raises Unsupported, and changes nothing then."""
    light = world_light(world)
    if has_rig(world):
        raise Unsupported("The world has a rig already; remove it first.")
    image = require_picture(light, world)
    settings = world.domelight
    if not settings.sun and not settings.lamps:
        raise Unsupported("Neither the sun nor lamps are asked for.")
    try:
        environment = dl.Environment(pixels.linear_rgb(image), up="z", name=image.name)
        rig = dl.lights(environment, None, sun=settings.sun, lamps=settings.lamps)
    except ValueError as error:
        raise Unsupported(f"{image.name}: {error}.") from error
    residual = residual_image(image, rig.residual)
    collection = bpy.data.collections.new(NAME)
    scene.collection.children.link(collection)
    turn = bpy.data.objects.new(NAME, None)
    turn.empty_display_type, turn.empty_display_size = "SPHERE", 0.5
    collection.objects.link(turn)
    if light.mapping is not None:
        follow_rotation(turn, world, light)
    for i, name in enumerate(rig.names):
        sun = sun_object(name, rig, i)
        sun.parent = turn
        collection.objects.link(sun)
        follow_strength(sun.data, world, light)
    settings.original, settings.residual, settings.collection = image, residual, collection
    light.picture.image = residual
    return len(rig)


def remove(world):
    """Remove the world's rig; the world has its picture again."""
    settings = world.domelight
    restore_picture(world)
    if settings.collection is not None:
        remove_collection(settings.collection)
    residual = settings.residual
    for name in ("original", "residual", "collection"):
        settings.property_unset(name)
    if residual is not None and residual.users == 0:
        bpy.data.images.remove(residual)


def restore_picture(world):
    """Show the original picture wherever the world shows the residual."""
    settings = world.domelight
    if world.node_tree is None or settings.residual is None:
        return
    for node in world.node_tree.nodes:
        if node.type == "TEX_ENVIRONMENT" and node.image == settings.residual:
            node.image = settings.original


def remove_collection(collection):
    """Remove a rig's lights and its empty; objects that were put beside them move to where the collection was."""
    is_light = lambda o: o.type == "LIGHT" and o.data.domelight.is_rig
    lights = [o for o in collection.objects if is_light(o)]
    turns = {o.parent for o in lights if o.parent is not None and o.parent.type == "EMPTY"}
    for light in lights:
        data = light.data
        bpy.data.objects.remove(light)
        if data.users == 0:
            bpy.data.lights.remove(data)
    for turn in turns:
        bpy.data.objects.remove(turn)
    parents = [c for c in all_collections() if collection.name in c.children]
    for other in list(collection.objects):
        for parent in parents:
            if other.name not in parent.objects:
                parent.objects.link(other)
    for child in list(collection.children):
        for parent in parents:
            if child.name not in parent.children:
                parent.children.link(child)
    bpy.data.collections.remove(collection)


def all_collections():
    """All collections of the file, those of scenes included."""
    return [*bpy.data.collections, *(scene.collection for scene in bpy.data.scenes)]


def residual_image(original, residual):
    """A new image of the light that stays in the world, packed into the file."""
    height, width = residual.shape
    image = bpy.data.images.new(f"{original.name} (residual)", width, height, float_buffer=True, alpha=False)
    if original.is_float:
        image.alpha_mode = original.alpha_mode
    texels = np.ones((height, width, 4), np.float32)
    texels[..., :3] = residual.map[::-1]
    image.pixels.foreach_set(texels.ravel())
    image.update()
    image.pack()
    return image


def sun_object(name, rig, i):
    """The light i of a rig as an object with the orientation that it has in the unturned map."""
    radius = float(rig.angular_radius[i])
    color, strength = color_and_strength(facing_disc(rig.irradiance[i], radius))
    data = bpy.data.lights.new(name, "SUN")
    data.color, data.energy, data.angle = color, strength, 2.0 * min(radius, np.pi / 2)
    data.domelight.is_rig, data.domelight.share = True, float(rig.share[i])
    sun = bpy.data.objects.new(name, data)
    # A sun shines along its −Z.
    sun.rotation_euler = Vector(BLENDER_FROM_Z_UP @ rig.directions[i]).to_track_quat("Z", "Y").to_euler()
    return sun


def follow_rotation(turn, world, light):
    """Turn an object with the world's picture.

    A mapping of points turns coordinates, so the picture turns the other way: by the negative angles in reverse order.
    """
    sign = 1.0 if light.is_inverse else -1.0
    turn.rotation_mode = "XYZ" if light.is_inverse else "ZYX"
    path = input_path(light.mapping, "Rotation")
    for axis in range(3):
        drive(turn, "rotation_euler", axis, world, f"{path}[{axis}]", sign)


def follow_strength(light, world, nodes):
    """Give a light the strength of the world."""
    drive(light, "energy", -1, world, input_path(nodes.background, "Strength"), light.energy)


def input_path(node, name):
    """The data path of a node's input, from its world."""
    index = list(node.inputs).index(node.inputs[name])
    return f'node_tree.nodes["{bpy.utils.escape_identifier(node.name)}"].inputs[{index}].default_value'


def drive(target, prop, index, world, path, factor):
    """Drive a property by a factor times a number of the world."""
    driver = target.driver_add(prop, index).driver
    variable = driver.variables.new()
    variable.name = "value"
    variable.targets[0].id_type = "WORLD"
    variable.targets[0].id = world
    variable.targets[0].data_path = path
    driver.type = "SCRIPTED"
    driver.expression = f"value * {factor!r}"


CLASSES = (LightRigLight, LightRigWorld)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.World.domelight = bpy.props.PointerProperty(type=LightRigWorld)
    bpy.types.Light.domelight = bpy.props.PointerProperty(type=LightRigLight)


def unregister():
    del bpy.types.Light.domelight
    del bpy.types.World.domelight
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
