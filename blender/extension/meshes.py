# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated meshes as arrays."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Corners:
    """The triangles of a mesh as consecutive corners."""

    positions: np.ndarray
    normals: np.ndarray
    # The slot of each triangle's material.
    slots: np.ndarray
    # The triangle corners' indices among the mesh's corners.
    loops: np.ndarray

    def of_slot(self, slot):
        """Which corners belong to the triangles of a slot."""
        return np.repeat(self.slots == slot, 3)


def read(values, name, width, kind=np.float32):
    """One attribute of a collection of Blender's, (N, width)."""
    array = np.empty(len(values) * width, kind)
    values.foreach_get(name, array)
    return array.reshape(-1, width) if width > 1 else array


def corners(mesh):
    """All triangles of a mesh."""
    mesh.calc_loop_triangles()
    triangles = mesh.loop_triangles
    loops = read(triangles, "loops", 3, np.int32).ravel()
    positions = read(mesh.vertices, "co", 3)[read(mesh.loops, "vertex_index", 1, np.int32)]
    return Corners(
        np.nan_to_num(positions[loops]),
        unit(read(mesh.corner_normals, "vector", 3)[loops]),
        read(triangles, "material_index", 1, np.int32),
        loops,
    )


def unit(normals):
    """Normals of length 1; those without one point up."""
    normals = np.nan_to_num(normals)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0, normals / np.maximum(lengths, 1e-30), np.array([0, 0, 1])).astype(np.float32)


def texture_coordinates(mesh, name, loops):
    """Texture coordinates of the triangles' corners by name, or those that are rendered; zeros without any."""
    layers = mesh.uv_layers
    layer = layers.get(name) if name else next((layer for layer in layers if layer.active_render), None)
    if layer is None:
        return np.zeros((len(loops), 2), np.float32)
    return read(layer.uv, "vector", 2)[loops]
