# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Orientations of lat-long maps.

Blender shows the middle of a map at +X, its right half toward −Y, and its top at +Z. In domelight, Z-up, the middle is
at +Y and the right half toward +X; Y-up, the middle is at −Z and the right half toward +X.
"""

import math

import numpy as np

# A direction of domelight, Z-up, as Blender's.
BLENDER_FROM_Z_UP = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], np.float64)

# A direction of Blender as domelight's, Y-up.
Y_UP_FROM_BLENDER = np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]], np.float64)


def euler_xyz(angles):
    """The matrix that turns about X, then Y, then Z [rad]."""
    (cx, cy, cz), (sx, sy, sz) = [math.cos(a) for a in angles], [math.sin(a) for a in angles]
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def map_from_world(angles, is_inverse):
    """The matrix by which a Mapping node turns directions; Texture mappings turn the other way."""
    turn = euler_xyz(angles)
    return turn.T if is_inverse else turn


def facing_disc(irradiance, angular_radius):
    """What a surface receives that faces a disc of uniform radiance with ∫ L dω = irradiance: E (1 + cos α) / 2."""
    return irradiance * (0.5 * (1.0 + math.cos(min(angular_radius, math.pi / 2))))


def color_and_strength(light):
    """A color whose largest channel is 1, and the factor that restores the light."""
    strength = float(max(light))
    if strength <= 0.0:
        return (1.0, 1.0, 1.0), 0.0
    return tuple(float(channel) / strength for channel in light), strength
