# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender with the extension of the archive $DOMELIGHT_EXTENSION, scenes for it, and pictures by its engines."""

import os
import sys
from pathlib import Path

import bpy
import numpy as np

MODULE = "bl_ext.user_default.domelight"


def start():
    """Read the factory settings, and enable the extension."""
    install()
    disable()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    enable()


def install():
    """Install the archive once in a process, as Blender's preferences do."""
    if MODULE in sys.modules:
        return
    bpy.ops.wm.read_factory_settings(use_empty=True)
    archive = os.environ["DOMELIGHT_EXTENSION"]
    done = bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    assert done == {"FINISHED"} and MODULE in sys.modules


def enable():
    import addon_utils

    assert addon_utils.enable(MODULE, default_set=True) is not None


def disable():
    import addon_utils

    addon_utils.disable(MODULE, default_set=True)


def extension(name):
    """A module of the installed extension."""
    return sys.modules[f"{MODULE}.{name}"]


def studio(height=64):
    """A map with a soft gradient, a small bright sun off every axis, and a lamp, (height, 2 height, 3)."""
    v, u = np.mgrid[0:height, 0 : 2 * height] + 0.5
    theta, phi = np.pi * v / height, np.pi * (u / height - 1.0)
    directions = np.stack([np.sin(theta) * np.sin(phi), np.sin(theta) * np.cos(phi), np.cos(theta)], -1)
    sky = np.array([0.3, 0.4, 0.6]) * (1.0 + 0.5 * directions[..., 2:])
    for toward, degrees, light in [
        ((0.5, 0.6, 0.7), 4.0, (90.0, 80.0, 60.0)),
        ((-0.8, 0.1, 0.4), 9.0, (6.0, 5.0, 7.0)),
    ]:
        cosine = directions @ (np.array(toward) / np.linalg.norm(toward))
        sky[cosine > np.cos(np.radians(degrees))] += light
    return sky.astype(np.float32)


def image(name, texels):
    """A packed picture in floating point; its top row is the first."""
    height, width = texels.shape[:2]
    made = bpy.data.images.new(name, width, height, float_buffer=True, alpha=False)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = texels[::-1]
    made.pixels.foreach_set(rgba.ravel())
    made.update()
    made.pack()
    return made


def world(texels, rotation=(0.0, 0.0, 0.0), strength=1.0, vector_type="POINT"):
    """The scene's world shows this map through a Mapping node."""
    made = bpy.data.worlds.new("world")
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    kinds = (
        "ShaderNodeTexCoord",
        "ShaderNodeMapping",
        "ShaderNodeTexEnvironment",
        "ShaderNodeBackground",
        "ShaderNodeOutputWorld",
    )
    coordinates, mapping, picture, background, output = [tree.nodes.new(kind) for kind in kinds]
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], picture.inputs["Vector"])
    tree.links.new(picture.outputs["Color"], background.inputs["Color"])
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    mapping.vector_type = vector_type
    mapping.inputs["Rotation"].default_value = rotation
    background.inputs["Strength"].default_value = strength
    picture.image = image("studio.exr", texels)
    bpy.context.scene.world = made
    return made


def material(name, color=(1.0, 1.0, 1.0)):
    """A matte material."""
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    diffuse, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(diffuse.outputs[0], output.inputs[0])
    return made


def add_object(name, data, location=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0)):
    """An object in the scene."""
    made = bpy.data.objects.new(name, data)
    made.location, made.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(made)
    return made


def white_ball():
    """A matte white ball of radius 1 before an orthographic camera that sees it from a little above."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=1)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(material("white"))
    data = bpy.data.cameras.new("camera")
    data.type, data.ortho_scale = "ORTHO", 2.1
    bpy.context.scene.camera = add_object("camera", data, (0.0, -4.0, 3.0), (np.arctan2(4.0, 3.0), 0.0, 0.0))
    return ball


def render(folder, engine="CYCLES", size=(48, 48), samples=256, transparent=True, cropped=None):
    """The scene as linear values (height, width, 4), by direct light alone; `cropped` is the size of a region."""
    scene = bpy.context.scene
    settings = scene.render
    settings.engine = engine
    if engine == "CYCLES":
        cycles = scene.cycles
        cycles.device, cycles.samples, cycles.seed = "CPU", samples, 1
        cycles.use_denoising = cycles.use_adaptive_sampling = False
        cycles.max_bounces, cycles.pixel_filter_type = 0, "BOX"
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    settings.film_transparent = transparent
    settings.filter_size = 1
    settings.resolution_x, settings.resolution_y = size
    settings.resolution_percentage = 100
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    settings.image_settings.color_mode = "RGBA"
    settings.filepath = str(folder / f"{engine.lower()}.exr")
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    picture = bpy.data.images.load(settings.filepath)
    width, height = cropped or size
    pixels = np.array(picture.pixels[:], np.float32).reshape(height, width, 4)[::-1]
    bpy.data.images.remove(picture)
    return pixels


def passes(engine, size):
    """The passes of a render, by name, as the engine hands them over: (height, width, channels)."""
    module = extension("engine")
    found = {}
    hand_over = module.hand_over

    def kept(result, name, values):
        found[name] = np.array(values)
        hand_over(result, name, values)

    module.hand_over = kept
    try:
        render(Path(bpy.app.tempdir), engine, size)
    finally:
        module.hand_over = hand_over
    return found


def keep(name, expected, found):
    """Write two pictures and their difference, ten times, into $DOMELIGHT_PICTURES if it is set."""
    folder = os.environ.get("DOMELIGHT_PICTURES")
    if folder is None:
        return
    difference = 0.5 + 10 * (found - expected) / (2 * expected[..., :3].mean())
    rows = [np.clip(p[..., :3], 0, 1) ** (1 / 2.2) for p in (expected, found)] + [np.clip(difference[..., :3], 0, 1)]
    sheet = np.concatenate(rows, axis=1)
    scaled = np.repeat(np.repeat(sheet, 4, axis=0), 4, axis=1)
    gltf = extension("gltf")
    (Path(folder) / f"{name}.png").write_bytes(gltf.png(gltf.texels_of(scaled, 8)))


def contents():
    """Everything that the file's data-blocks say, as text: one entry for each property."""
    bpy.context.view_layer.update()
    found = {}
    for name in dir(bpy.data):
        blocks = getattr(bpy.data, name)
        if not isinstance(blocks, bpy.types.bpy_prop_collection) or name in (
            "screens",
            "window_managers",
            "workspaces",
        ):
            continue
        for block in blocks:
            describe(block, f"{name}/{block.name}", found, depth=0)
    return found


# What changes by itself, or points back to its owner.
PASSED_OVER = {
    "rna_type",
    "id_data",
    "original",
    "depsgraph",
    "tool_settings",
    "preview",
    "session_uid",
    "bindcode",
    "users",
    "pixels",
    "is_dirty",
}


def describe(struct, path, found, depth):
    """Add the properties of a structure."""
    if isinstance(struct, bpy.types.ID):
        found[f"{path}.users"] = str(struct.users)
        found[f"{path}.custom"] = str(sorted(set(struct.keys()) - set(struct.bl_rna.properties.keys())))
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in PASSED_OVER or name.startswith("is_") and isinstance(struct, bpy.types.ID):
            continue
        try:
            value = getattr(struct, name)
        except (AttributeError, RuntimeError):
            continue
        where = f"{path}.{name}"
        if prop.type == "COLLECTION":
            found[f"{where}.length"] = str(len(value))
            for i, item in enumerate(value) if depth < 6 and len(value) < 100 else ():
                if isinstance(item, bpy.types.ID):
                    found[f"{where}[{i}]"] = item.name
                else:
                    describe(item, f"{where}[{i}]", found, depth + 1)
        elif prop.type == "POINTER":
            if value is None or isinstance(value, bpy.types.ID) and not value.is_embedded_data:
                found[where] = str(value and value.name)
            elif depth < 6:
                describe(value, where, found, depth + 1)
        elif getattr(prop, "is_array", False):
            found[where] = str([*value][:64])
        else:
            found[where] = str(value)
