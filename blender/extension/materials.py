# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's materials as glTF's: Principled, Diffuse, Glossy and Emission with image textures."""

import math

import bpy
import numpy as np

from . import gltf, pixels
from .failure import Unsupported
from .world import describe, source

WRAP = {"REPEAT": gltf.REPEAT, "EXTEND": gltf.CLAMP, "CLIP": gltf.CLAMP, "MIRROR": gltf.MIRROR}

# Inputs of the Principled BSDF that are not covered, with the value at which they do nothing.
PRINCIPLED_LEFT_OUT = {
    "Diffuse Roughness": 0.0,
    "Subsurface Weight": 0.0,
    "Anisotropic": 0.0,
    "Thin Film Thickness": 0.0,
}


class Materials:
    """Writes materials, each once."""

    def __init__(self, file, notes):
        self.file = file
        self.notes = notes
        self.written = {}
        self.textures = {}
        self.extensions = set()

    def index(self, material):
        """The index of a material with the names of the texture coordinates that it needs, in order."""
        key = material.name_full if material else None
        if key not in self.written:
            writer = MaterialWriter(self, material)
            self.written[key] = self.file.append("materials", writer.item()), writer.uv_names
        return self.written[key]


class MaterialWriter:
    """One material."""

    def __init__(self, materials, material):
        self.materials = materials
        self.material = material
        self.uv_names = []

    @property
    def name(self):
        return self.material.name if self.material else "no material"

    def note(self, what):
        self.materials.notes.add(what, self.name)

    def item(self):
        """The glTF material."""
        item = {"name": self.name, "doubleSided": True}
        material = self.material
        if material is None:
            return item | matte((0.8, 0.8, 0.8), self)
        if material.node_tree is None or bpy.app.version < (5, 0, 0) and not material.use_nodes:
            return item | matte(material.diffuse_color[:3], self)
        output = material.node_tree.get_output_node("ALL")
        shader, _ = source(output.inputs["Surface"]) if output else (None, None)
        if output and output.inputs["Displacement"].is_linked:
            self.note("displacement")
        write = {
            "BSDF_PRINCIPLED": self.principled,
            "BSDF_DIFFUSE": self.diffuse,
            "BSDF_GLOSSY": self.glossy,
            "EMISSION": self.emission,
        }.get(shader.type if shader else None)
        if write is None:
            self.note(f"the node {describe(shader)}" if shader else "a surface without a shader")
            return item | matte((0.8, 0.8, 0.8) if shader else (0.0, 0.0, 0.0), self)
        return item | write(shader)

    def principled(self, node):
        """The Principled BSDF."""
        value = lambda name: number(node.inputs[name])
        for name, idle in PRINCIPLED_LEFT_OUT.items():
            if name in node.inputs and (node.inputs[name].is_linked or value(name) != idle):
                self.note(name)
        base, texture = self.color(node.inputs["Base Color"])
        roughness, metallic, both = self.roughness_and_metallic(node.inputs["Roughness"], node.inputs["Metallic"])
        pbr = {"baseColorFactor": [*base, 1.0], "roughnessFactor": roughness, "metallicFactor": metallic}
        item = {"pbrMetallicRoughness": pbr, "extensions": {}}
        self.opacity(node.inputs["Alpha"], pbr, item, node.inputs["Base Color"], texture)
        if both is not None:
            pbr["metallicRoughnessTexture"] = both
        self.normal(node.inputs["Normal"], item, "normalTexture")
        self.reflection(node, item)
        self.coat(node, item)
        self.sheen(node, item)
        if self.unlinked(node.inputs["Transmission Weight"]) > 0:
            self.note("refraction")
            self.extend(item, "KHR_materials_transmission", {"transmissionFactor": value("Transmission Weight")})
        self.emit(node.inputs["Emission Color"], self.unlinked(node.inputs["Emission Strength"]), item)
        return item

    def reflection(self, node, item):
        """The dielectric's reflection. Blender's level scales the reflectance at normal incidence, by another index."""
        level, ior = self.unlinked(node.inputs["Specular IOR Level"]), self.unlinked(node.inputs["IOR"])
        f0 = min(2 * level * ((ior - 1) / (ior + 1)) ** 2, 0.9)
        root = math.sqrt(f0)
        self.extend(item, "KHR_materials_ior", {"ior": (1 + root) / (1 - root)})
        tint = self.unlinked_color(node.inputs["Specular Tint"])
        self.extend(item, "KHR_materials_specular", {"specularFactor": float(f0 > 0), "specularColorFactor": tint})

    def coat(self, node, item):
        """The coat, over the surface with or without its normal map."""
        weight = self.unlinked(node.inputs["Coat Weight"])
        if weight == 0:
            return
        if self.unlinked_color(node.inputs["Coat Tint"]) != [1.0, 1.0, 1.0]:
            self.note("Coat Tint")
        if self.unlinked(node.inputs["Coat IOR"]) != 1.5:
            self.note("Coat IOR other than 1.5")
        values = {"clearcoatFactor": weight, "clearcoatRoughnessFactor": self.unlinked(node.inputs["Coat Roughness"])}
        self.normal(node.inputs["Coat Normal"], values, "clearcoatNormalTexture")
        self.extend(item, "KHR_materials_clearcoat", values)

    def sheen(self, node, item):
        """The sheen, whose model is another one."""
        weight = self.unlinked(node.inputs["Sheen Weight"])
        if weight == 0:
            return
        self.note("Blender's own model of sheen")
        tint = [weight * channel for channel in self.unlinked_color(node.inputs["Sheen Tint"])]
        values = {"sheenColorFactor": tint, "sheenRoughnessFactor": self.unlinked(node.inputs["Sheen Roughness"])}
        self.extend(item, "KHR_materials_sheen", values)

    def diffuse(self, node):
        """The Diffuse BSDF."""
        if self.unlinked(node.inputs["Roughness"]) != 0:
            self.note("the roughness of the Diffuse BSDF")
        base, texture = self.color(node.inputs["Color"])
        item = matte(base, self)
        if texture is not None:
            item["pbrMetallicRoughness"]["baseColorTexture"] = texture
        self.normal(node.inputs["Normal"], item, "normalTexture")
        return item

    def glossy(self, node):
        """The Glossy BSDF, a metal."""
        base, texture = self.color(node.inputs["Color"])
        if "Anisotropy" in node.inputs and self.unlinked(node.inputs["Anisotropy"]) != 0:
            self.note("Anisotropy")
        roughness, _, both = self.roughness_and_metallic(node.inputs["Roughness"], None)
        pbr = {"baseColorFactor": [*base, 1.0], "roughnessFactor": roughness, "metallicFactor": 1.0}
        if texture is not None:
            pbr["baseColorTexture"] = texture
        if both is not None:
            pbr["metallicRoughnessTexture"] = both
        item = {"pbrMetallicRoughness": pbr}
        self.normal(node.inputs["Normal"], item, "normalTexture")
        return item

    def emission(self, node):
        """The Emission node: black under light."""
        item = matte((0.0, 0.0, 0.0), self)
        self.emit(node.inputs["Color"], self.unlinked(node.inputs["Strength"]), item)
        return item

    def emit(self, socket, strength, item):
        """Light that the camera sees; it lights nothing."""
        if strength == 0 or not socket.is_linked and not any(socket.default_value[:3]):
            return
        self.note("light from surfaces")
        color, texture = self.color(socket)
        most = max(*color, 1e-6)
        item["emissiveFactor"] = [channel / most for channel in color]
        self.extend(item, "KHR_materials_emissive_strength", {"emissiveStrength": strength * most})
        if texture is not None:
            item["emissiveTexture"] = texture

    def extend(self, item, name, values):
        """Add an extension to a material."""
        item.setdefault("extensions", {})[name] = values
        self.materials.extensions.add(name)

    def unlinked(self, socket):
        """The number of an input; links are noted."""
        if socket.is_linked:
            self.note(f"what is linked to {socket.name}")
        return number(socket)

    def unlinked_color(self, socket):
        """The color of an input; links are noted."""
        if socket.is_linked:
            self.note(f"what is linked to {socket.name}")
        return [float(channel) for channel in socket.default_value[:3]]

    def color(self, socket):
        """A factor and a texture or None."""
        found = self.picture(socket)
        if found is None:
            return [clamped(channel) for channel in socket.default_value[:3]], None
        if found[1] != "Color":
            self.note(f"a single channel as {socket.name}")
            return [clamped(channel) for channel in socket.default_value[:3]], None
        node, _, reference = found
        return [1.0, 1.0, 1.0], self.reference(
            ("color", node.image.name_full), node, reference, lambda: srgb_texels(node.image)
        )

    def opacity(self, socket, pbr, item, base, texture):
        """The alpha of a material, by a number or in the base color's texture."""
        found = self.picture(socket)
        base_found = self.picture(base)
        if texture is not None:
            pbr["baseColorTexture"] = texture
        if found is None:
            alpha = clamped(number(socket))
            if alpha < 1:
                pbr["baseColorFactor"][3], item["alphaMode"] = alpha, "BLEND"
            return
        node, output, reference = found
        item["alphaMode"] = "BLEND"
        if base_found is not None and base_found[0].image != node.image:
            self.note("an Alpha from another picture than the Base Color's")
        color = base_found[0].image if base_found is not None else None
        name = ("alpha", node.image.name_full, output, color and color.name_full)
        make = lambda: alpha_texels(color, node.image, output)
        pbr["baseColorTexture"] = self.reference(name, node, reference, make)

    def roughness_and_metallic(self, rough, metal):
        """Factors of roughness and metallic, and one texture of both or None."""
        rough_found = self.picture(rough)
        metal_found = self.picture(metal) if metal is not None else None
        roughness = 1.0 if rough_found else clamped(number(rough))
        metallic = 1.0 if metal_found else clamped(number(metal)) if metal is not None else 1.0
        if rough_found is None and metal_found is None:
            return roughness, metallic, None
        if rough_found and metal_found and rough_found[2] != metal_found[2]:
            self.note("Roughness and Metallic with different texture coordinates")
        node, _, reference = rough_found or metal_found
        channels = [(found[0].image, found[1]) if found else None for found in (rough_found, metal_found)]
        name = ("data", *[channel and (channel[0].name_full, channel[1]) for channel in channels])
        return roughness, metallic, self.reference(name, node, reference, lambda: data_texels(*channels))

    def normal(self, socket, item, name):
        """A tangent-space normal map."""
        node, _ = source(socket)
        if node is None:
            return
        if node.type != "NORMAL_MAP" or node.space != "TANGENT":
            self.note(f"the node {describe(node)}")
            return
        found = self.picture(node.inputs["Color"])
        if found is None:
            return
        texture, _, (uv, transform) = found
        reference = (node.uv_map or uv, transform)
        made = self.reference(("raw", texture.image.name_full), texture, reference, lambda: raw_texels(texture.image))
        item[name] = made | {"scale": self.unlinked(node.inputs["Strength"])}

    def picture(self, socket):
        """The Image Texture of an input, which output or channel it uses, and its coordinates; None without one."""
        node, output = source(socket)
        if node is None:
            return None
        channel = output.name
        if node.type == "SEPARATE_COLOR" and node.mode == "RGB":
            inner, inner_output = source(node.inputs[0])
            if inner is not None and inner.type == "TEX_IMAGE" and inner_output.name == "Color":
                node = inner
        if node.type != "TEX_IMAGE" or node.image is None or node.projection != "FLAT" or node.mute:
            self.note(f"the node {describe(node)}")
            return None
        if node.extension == "CLIP":
            self.note("the extension Clip")
        try:
            pixels.is_srgb(node.image)
            pixels.raw(node.image)
        except Unsupported as error:
            self.note(str(error).rstrip("."))
            return None
        coordinates = self.coordinates(node)
        return None if coordinates is None else (node, channel, coordinates)

    def coordinates(self, node):
        """The name of the texture coordinates, and their transform (scale, rotation, offset) or None."""
        transform = None
        vector, output = source(node.inputs["Vector"])
        if vector is not None and vector.type == "MAPPING":
            if vector.vector_type != "POINT":
                self.note(f"the type of {describe(vector)}")
            transform = mapping_transform(vector)
            vector, output = source(vector.inputs["Vector"])
        if vector is None or vector.type == "TEX_COORD" and output.name == "UV":
            return "", transform
        if vector.type == "UVMAP":
            return vector.uv_map, transform
        self.note(f"the coordinates of {describe(vector)}")
        return None

    def reference(self, name, node, coordinates, make):
        """A reference to a texture, which is written once."""
        uv, transform = coordinates
        wrap, magnification = WRAP[node.extension], gltf.NEAREST if node.interpolation == "Closest" else gltf.LINEAR
        key = (name, wrap, magnification)
        textures = self.materials.textures
        if key not in textures:
            textures[key] = self.materials.file.texture(make(), wrap, magnification)
        if uv not in self.uv_names:
            self.uv_names.append(uv)
        reference = {"index": textures[key], "texCoord": self.uv_names.index(uv)}
        if transform is not None:
            reference["extensions"] = {"KHR_texture_transform": transform}
            self.materials.extensions.add("KHR_texture_transform")
        return reference


def matte(color, writer):
    """A Lambertian material: a dielectric without reflection."""
    writer.materials.extensions.add("KHR_materials_specular")
    pbr = {"baseColorFactor": [*map(clamped, color), 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}
    return {"pbrMetallicRoughness": pbr, "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}}}


def number(socket):
    """The number of an input."""
    return float(socket.default_value)


def clamped(value):
    return min(max(float(value), 0.0), 1.0)


def mapping_transform(node):
    """A Mapping node of points as KHR_texture_transform, whose coordinates count from the top."""
    (x, y, _), (sx, sy, _) = node.inputs["Location"].default_value, node.inputs["Scale"].default_value
    angle = node.inputs["Rotation"].default_value[2]
    # Blender: uv' = R(angle) S uv + t, bottom up. With v = 1 − v on both sides, the rotation turns the other way.
    sin, cos = math.sin(angle), math.cos(angle)
    offset = [x - sin * sy, 1 - y - cos * sy]
    return {"scale": [sx, sy], "rotation": angle, "offset": offset}


def srgb_texels(image):
    """Colors as texels by the sRGB curve."""
    values = pixels.raw(image)
    rgb = three_channels(values)
    if pixels.is_srgb(image):
        return gltf.texels_of(rgb, 8)
    return gltf.texels_of(pixels.linear_to_srgb(np.clip(rgb, 0, 1)), 16)


def raw_texels(image):
    """Numbers that are no colors, such as normals."""
    values = three_channels(pixels.raw(image))
    if pixels.is_srgb(image):
        return gltf.texels_of(pixels.srgb_to_linear(values), 16)
    return gltf.texels_of(values, 16 if image.is_float else 8)


def alpha_texels(color, alpha, output):
    """Colors by the sRGB curve, with the alpha of a picture or with its color as alpha."""
    opacity = channel_of(alpha, output)
    if color is None:
        rgb = np.ones((*opacity.shape, 3), np.float32)
    else:
        rgb = three_channels(pixels.raw(color))
        rgb = rgb if pixels.is_srgb(color) else pixels.linear_to_srgb(np.clip(rgb, 0, 1))
    height, width = max(rgb.shape[0], opacity.shape[0]), max(rgb.shape[1], opacity.shape[1])
    both = np.concatenate([resized(rgb, height, width), resized(opacity[..., None], height, width)], axis=2)
    return gltf.texels_of(both, 16)


def data_texels(rough, metal):
    """Roughness as green and metallic as blue."""
    channels = [channel_of(*found) if found else None for found in (rough, metal)]
    height = max(c.shape[0] for c in channels if c is not None)
    width = max(c.shape[1] for c in channels if c is not None)
    texels = np.ones((height, width, 3), np.float32)
    for i, channel in enumerate(channels):
        if channel is not None:
            texels[..., i + 1] = resized(channel[..., None], height, width)[..., 0]
    return gltf.texels_of(texels, 16)


def channel_of(image, output):
    """One channel of a picture by the name of an output: linear, (H, W)."""
    values = pixels.raw(image)
    if output == "Alpha":
        return values[..., 3] if values.shape[2] == 4 else np.ones(values.shape[:2], np.float32)
    rgb = pixels.linear_rgb(image)
    if output in ("Red", "Green", "Blue"):
        return rgb[..., ("Red", "Green", "Blue").index(output)]
    # A color that a number is made of.
    return rgb @ np.array([0.2126, 0.7152, 0.0722], np.float32)


def three_channels(values):
    return values[..., :3] if values.shape[2] >= 3 else np.repeat(values[..., :1], 3, axis=2)


def resized(values, height, width):
    """A picture with as many rows and columns, by the nearest."""
    rows = (np.arange(height) + 0.5) * values.shape[0] / height
    columns = (np.arange(width) + 0.5) * values.shape[1] / width
    return values[rows.astype(int)][:, columns.astype(int)]
