# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions and lights, without Blender."""

import math

import numpy as np
import pytest
from extension import orientation


def test_frames_agree_on_the_middle_and_the_right_of_a_map():
    middle, right, up = np.array([1, 0, 0]), np.array([0, -1, 0]), np.array([0, 0, 1])
    assert np.array_equal(orientation.BLENDER_FROM_Z_UP @ [0, 1, 0], middle)
    assert np.array_equal(orientation.BLENDER_FROM_Z_UP @ [1, 0, 0], right)
    assert np.array_equal(orientation.Y_UP_FROM_BLENDER @ middle, [0, 0, -1])
    assert np.array_equal(orientation.Y_UP_FROM_BLENDER @ right, [1, 0, 0])
    assert np.array_equal(orientation.Y_UP_FROM_BLENDER @ up, [0, 1, 0])
    for matrix in (orientation.BLENDER_FROM_Z_UP, orientation.Y_UP_FROM_BLENDER):
        assert np.linalg.det(matrix) == 1.0


def test_a_mapping_turns_about_x_then_y_then_z():
    turn = orientation.euler_xyz((math.pi / 2, 0, math.pi / 2))
    assert np.allclose(turn @ [0, 1, 0], [0, 0, 1])
    assert np.allclose(turn @ [1, 0, 0], [0, 1, 0])
    angles = (0.3, -1.1, 2.0)
    both = orientation.map_from_world(angles, False) @ orientation.map_from_world(angles, True)
    assert np.allclose(both, np.eye(3))


def test_a_facing_surface_receives_less_than_all_directions_together():
    # A disc of radiance 1: 2π (1 − cos α) over all directions, π sin² α on a surface.
    for radius in (1e-3, 0.3, math.pi / 2):
        total = 2 * math.pi * (1 - math.cos(radius))
        assert orientation.facing_disc(total, radius) == pytest.approx(math.pi * math.sin(radius) ** 2)


def test_color_and_strength_restore_the_light():
    color, strength = orientation.color_and_strength((2.0, 8.0, 4.0))
    assert color == (0.25, 1.0, 0.5) and strength == 8.0
    assert orientation.color_and_strength((0.0, 0.0, 0.0)) == ((1.0, 1.0, 1.0), 0.0)
