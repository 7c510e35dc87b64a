# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as its dependency graph evaluates it, as glTF and as an environment."""

from pathlib import Path

import domelight as dl
import numpy as np

from . import light_rig, meshes, pixels
from .gltf import Gltf
from .materials import Materials
from .orientation import Y_UP_FROM_BLENDER
from .world import world_light

# Objects that have a surface.
SURFACES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
WITHOUT_SURFACE = {"CURVES": "hair", "POINTCLOUD": "point clouds", "VOLUME": "volumes", "GREASEPENCIL": "Grease Pencil"}


def export(depsgraph, folder, turn, notes):
    """Write the scene's surfaces, turned by a matrix (3, 3), as glTF. Returns the file; None without any."""
    file = Gltf(Path(folder))
    materials = Materials(file, notes)
    written = {}
    for instance in depsgraph.object_instances:
        surface = instance.object
        if not instance.show_self:
            continue
        if surface.type == "LIGHT" and not surface.data.domelight.is_rig:
            notes.add("lights", surface.name)
        if surface.type in WITHOUT_SURFACE:
            notes.add(WITHOUT_SURFACE[surface.type], surface.name)
        if surface.type not in SURFACES:
            continue
        note_visibility(surface, notes)
        slots = [slot.material for slot in surface.material_slots]
        key = (surface.data.as_pointer(), tuple(m and m.name_full for m in slots))
        if key not in written:
            written[key] = mesh_of(surface, depsgraph, slots, file, materials)
        if written[key] is not None:
            file.node(written[key], instance.matrix_world)
    if "nodes" not in file.root:
        return None
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    return file.write(matrix, materials.extensions)


def note_visibility(surface, notes):
    """Note switches that hide a surface from some rays."""
    original = surface.original
    if not original.visible_camera:
        notes.add("objects that the camera does not see", original.name)
    if not original.visible_shadow:
        notes.add("objects without a shadow", original.name)
    if original.is_shadow_catcher:
        notes.add("shadow catchers", original.name)
    if original.is_holdout:
        notes.add("holdouts", original.name)


def mesh_of(surface, depsgraph, slots, file, materials):
    """Write the mesh of an object with its materials, and return its index; None without triangles."""
    mesh = surface.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)
    if mesh is None or not len(mesh.polygons):
        surface.to_mesh_clear()
        return None
    corners = meshes.corners(mesh)
    primitives = []
    # Blender draws faces beyond the last slot with its material.
    last = max(len(slots) - 1, 0)
    corners.slots = np.minimum(corners.slots, last)
    for slot in np.unique(corners.slots):
        material, uv_names = materials.index(slots[slot] if slots else None)
        own = corners.of_slot(slot)
        uvs = [meshes.texture_coordinates(mesh, name, corners.loops[own]) for name in uv_names]
        primitives.append(file.primitive(corners.positions[own], corners.normals[own], uvs, material))
    surface.to_mesh_clear()
    return file.append("meshes", {"primitives": primitives})


def environment(world):
    """The light of a world and the matrix (3, 3) that turns the world to it. Raises Unsupported."""
    light = world_light(world)
    if light.picture is None or light.picture.image is None:
        color = light.background.inputs["Color"].default_value[:3] if light.background else world.color
        texels = np.broadcast_to(np.array(color, np.float32), (4, 8, 3))
    elif light_rig.has_rig(world) and light.picture.image == world.domelight.residual:
        # The suns of the rig are in the map that it replaced.
        texels = pixels.linear_rgb(world.domelight.original)
    else:
        texels = pixels.linear_rgb(light.picture.image)
    turn = Y_UP_FROM_BLENDER @ light.map_from_world
    return dl.Environment(texels, scale=light.strength, name=world.name), turn
