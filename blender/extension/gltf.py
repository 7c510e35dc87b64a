# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes glTF 2.0: arrays as buffers of their own, pictures as PNG."""

import json
import struct
import zlib

import numpy as np

FLOAT, UNSIGNED_INT = 5126, 5125
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

# Blender's names of what lies outside a picture, and glTF's.
REPEAT, CLAMP, MIRROR = 10497, 33071, 33648
NEAREST, LINEAR = 9728, 9729


class Gltf:
    """A glTF scene that grows, in a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.root = {"asset": {"version": "2.0", "generator": "domelight for Blender"}}

    def append(self, kind, item):
        """Add an item to one of the lists, and return its index."""
        items = self.root.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def accessor(self, values):
        """Write an array (N,) of uint32 or (N, M) of float32."""
        values = np.ascontiguousarray(values)
        name = f"{len(self.root.get('buffers', ()))}.bin"
        values.tofile(self.folder / name)
        buffer = self.append("buffers", {"uri": name, "byteLength": values.nbytes})
        view = self.append("bufferViews", {"buffer": buffer, "byteLength": values.nbytes})
        kind = UNSIGNED_INT if values.dtype == np.uint32 else FLOAT
        width = values.shape[1] if values.ndim == 2 else 1
        item = {"bufferView": view, "componentType": kind, "count": len(values), "type": TYPES[width]}
        if width == 3:
            item["min"], item["max"] = values.min(0).tolist(), values.max(0).tolist()
        return self.append("accessors", item)

    def primitive(self, positions, normals, uvs, material):
        """Triangles as consecutive corners; `uvs` are sets of texture coordinates, bottom up as in Blender."""
        attributes = {"POSITION": self.accessor(positions), "NORMAL": self.accessor(normals)}
        for i, uv in enumerate(uvs):
            attributes[f"TEXCOORD_{i}"] = self.accessor(flipped(uv))
        return {"attributes": attributes, "material": material}

    def texture(self, texels, wrap, magnification):
        """Write a picture (H, W, 3 or 4) of uint8 or uint16, and return the index of its texture."""
        name = f"{len(self.root.get('images', ()))}.png"
        (self.folder / name).write_bytes(png(texels))
        image = self.append("images", {"uri": name})
        sampler = self.append("samplers", {"wrapS": wrap, "wrapT": wrap, "magFilter": magnification})
        return self.append("textures", {"source": image, "sampler": sampler})

    def node(self, mesh, matrix):
        """Place a mesh, by a matrix (4, 4) that acts on columns."""
        return self.append("nodes", {"mesh": mesh, "matrix": columns(matrix)})

    def write(self, world, extensions):
        """Write the file, with all nodes below one that has the matrix `world`, and return its path."""
        children = list(range(len(self.root.get("nodes", ()))))
        top = self.append("nodes", {"matrix": columns(world), "children": children})
        self.root["scenes"], self.root["scene"] = [{"nodes": [top]}], 0
        if extensions:
            self.root["extensionsUsed"] = sorted(extensions)
        path = self.folder / "scene.gltf"
        path.write_text(json.dumps(self.root))
        return path


def columns(matrix):
    """The numbers of a matrix, column by column."""
    return np.asarray(matrix, np.float64).T.ravel().tolist()


def flipped(uv):
    """Texture coordinates from the top, as glTF has them."""
    return np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]).astype(np.float32)


def png(texels):
    """A PNG of texels (H, W, 3 or 4), uint8 or uint16."""
    height, width, channels = texels.shape
    depth = 8 * texels.dtype.itemsize
    rows = np.ascontiguousarray(texels, texels.dtype.newbyteorder(">")).view(np.uint8).reshape(height, -1)
    # Each row begins with its filter: none.
    data = np.concatenate([np.zeros((height, 1), np.uint8), rows], axis=1).tobytes()
    header = struct.pack(">IIBBBBB", width, height, depth, {3: 2, 4: 6}[channels], 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(data, 1)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(kind, data) for kind, data in chunks)


def chunk(kind, data):
    """A chunk of a PNG."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def texels_of(values, depth):
    """Values in [0, 1] as texels of 8 or 16 bits."""
    kind, most = (np.uint8, 255) if depth == 8 else (np.uint16, 65535)
    return np.round(np.clip(np.nan_to_num(values), 0.0, 1.0) * most).astype(kind)
