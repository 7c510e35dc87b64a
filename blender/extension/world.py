# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""What lights a world: its HDRI, with rotation and strength, or one color."""

from dataclasses import dataclass

import bpy

from .failure import Unsupported
from .orientation import map_from_world


@dataclass
class WorldLight:
    """The nodes that make the light of a world."""

    # The Environment Texture, or None for one color.
    picture: bpy.types.Node | None
    # The Mapping node in front of it, or None.
    mapping: bpy.types.Node | None
    background: bpy.types.Node | None

    @property
    def strength(self):
        """The factor on the light."""
        return self.background.inputs["Strength"].default_value if self.background else 1.0

    @property
    def angles(self):
        """The rotation of the Mapping node [rad]."""
        return tuple(self.mapping.inputs["Rotation"].default_value) if self.mapping else (0.0, 0.0, 0.0)

    @property
    def is_inverse(self):
        """Whether the Mapping node turns the picture instead of its coordinates."""
        return self.mapping is not None and self.mapping.vector_type == "TEXTURE"

    @property
    def map_from_world(self):
        """The matrix that turns directions of the world to where the picture is looked up."""
        return map_from_world(self.angles, self.is_inverse)


def source(socket):
    """The node that a socket is linked to, through reroutes, with the socket there; (None, None) without one."""
    while socket.is_linked:
        link = socket.links[0]
        if link.from_node.type != "REROUTE":
            return link.from_node, link.from_socket
        socket = link.from_node.inputs[0]
    return None, None


def describe(node):
    """A node as the user sees it."""
    return f"“{node.label or node.name}”"


def world_light(world):
    """Find what lights a world. Raises Unsupported for nodes that change the light in other ways."""
    if world is None:
        raise Unsupported("The scene has no world; add one with an Environment Texture.")
    tree = world.node_tree
    if tree is None or not uses_nodes(world):
        return WorldLight(None, None, None)
    output = tree.get_output_node("ALL")
    background, _ = source(output.inputs["Surface"]) if output else (None, None)
    if background is None:
        raise Unsupported(f"Nothing is linked to the output of the world {world.name}; link a Background node.")
    if background.type != "BACKGROUND" or background.mute:
        raise Unsupported(f"The node {describe(background)} is not supported; link one Background node to the output.")
    if background.inputs["Strength"].is_linked:
        raise Unsupported(f"The strength of {describe(background)} is linked; give it a number.")
    picture, _ = source(background.inputs["Color"])
    if picture is None:
        return WorldLight(None, None, background)
    if picture.type != "TEX_ENVIRONMENT" or picture.mute:
        raise Unsupported(
            f"The node {describe(picture)} is not supported; link an Environment Texture to the Background directly."
        )
    if picture.projection != "EQUIRECTANGULAR":
        raise Unsupported(f"The projection of {describe(picture)} is not Equirectangular.")
    return WorldLight(picture, mapping_of(picture), background)


def mapping_of(picture):
    """The Mapping node of an Environment Texture. Raises Unsupported if it does more than to turn it."""
    mapping, socket = source(picture.inputs["Vector"])
    if mapping is None:
        return None
    if mapping.type == "TEX_COORD":
        check_coordinates(mapping, socket)
        return None
    if mapping.type != "MAPPING" or mapping.mute:
        raise Unsupported(f"The node {describe(mapping)} is not supported; turn the picture by a Mapping node.")
    if mapping.inputs["Rotation"].is_linked:
        raise Unsupported(f"The rotation of {describe(mapping)} is linked; give it numbers or drivers.")
    place = mapping.inputs.get("Location")
    is_moved = place is not None and place.enabled and any(place.default_value)
    if is_moved or tuple(mapping.inputs["Scale"].default_value) != (1.0, 1.0, 1.0):
        raise Unsupported(f"{describe(mapping)} moves or scales; only its rotation is supported.")
    coordinates, socket = source(mapping.inputs["Vector"])
    if coordinates is None:
        raise Unsupported(
            f"Nothing is linked to the vector of {describe(mapping)}; link Texture Coordinate, Generated."
        )
    check_coordinates(coordinates, socket)
    return mapping


def check_coordinates(node, socket):
    """Generated coordinates of a world are its directions."""
    if node.type != "TEX_COORD" or socket.name != "Generated":
        raise Unsupported(f"The coordinates of {describe(node)} are not supported; use Texture Coordinate, Generated.")


def uses_nodes(world):
    """Worlds always have nodes since Blender 5."""
    return True if bpy.app.version >= (5, 0, 0) else world.use_nodes


def require_picture(light, world):
    """The image of the light. Raises Unsupported without one."""
    if light.picture is None or light.picture.image is None:
        raise Unsupported(f"The world {world.name} has no HDRI; link an Environment Texture with a picture.")
    return light.picture.image
