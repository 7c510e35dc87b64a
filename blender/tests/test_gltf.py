# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""The glTF writer, without Blender: read back by domelight."""

import struct
import zlib

import numpy as np
import pytest
from extension import gltf
from extension.notes import Notes


def unpacked(data):
    """The rows of a PNG without filters, bytes."""
    at = data.index(b"IDAT")
    (length,) = struct.unpack(">I", data[at - 4 : at])
    return zlib.decompress(data[at + 4 : at + 4 + length])


def test_pictures_keep_their_texels():
    texels = np.arange(2 * 3 * 3, dtype=np.uint16).reshape(2, 3, 3) * 3001
    rows = unpacked(gltf.png(texels))
    row = 1 + 3 * 3 * 2
    for y in range(2):
        assert rows[y * row] == 0
        assert np.array_equal(np.frombuffer(rows[y * row + 1 : (y + 1) * row], ">u2").reshape(3, 3), texels[y])
    assert unpacked(gltf.png(np.full((1, 1, 4), 7, np.uint8))) == bytes([0, 7, 7, 7, 7])


def test_values_outside_a_picture_are_clamped():
    values = np.array([[-1.0, 0.5, 2.0, np.nan]])
    assert gltf.texels_of(values, 8).tolist() == [[0, 128, 255, 0]]
    assert gltf.texels_of(values, 16).tolist() == [[0, 32768, 65535, 0]]


def test_a_scene_is_read_back(tmp_path):
    dl = pytest.importorskip("domelight")
    file = gltf.Gltf(tmp_path)
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], np.float32)
    normals = np.tile(np.array([[0, 0, 1]], np.float32), (3, 1))
    material = file.append("materials", {"pbrMetallicRoughness": {"metallicFactor": 0}})
    mesh = file.append("meshes", {"primitives": [file.primitive(triangle, normals, [triangle[:, :2]], material)]})
    move = np.eye(4)
    move[0, 3] = 3.0
    for matrix in (np.eye(4), move):
        file.node(mesh, matrix)
    turn = np.eye(4)
    turn[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    scene = dl.Scene.load(file.write(turn, set()))
    assert scene.n_triangles == 2
    assert np.allclose(scene.bounds, [[-2, 0, 0], [0, 4, 0]])


def test_notes_name_each_thing_once():
    notes = Notes()
    assert notes.text() == ""
    for name in ("a", "b", "a", "c", "d", "e"):
        notes.add("lights", name)
    notes.add("hair", "x")
    assert notes.text() == "Not covered: lights (a, b, c and 2 more); hair (x)."
