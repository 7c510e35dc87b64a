# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's cameras as domelight's."""

import math
from dataclasses import dataclass

import domelight as dl
import numpy as np

from .failure import Unsupported


@dataclass(frozen=True)
class Window:
    """The part of the image plane that a picture shows, at unit distance from a perspective camera."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def size(self):
        return self.right - self.left, self.top - self.bottom

    @property
    def shift(self):
        """The middle of the window, in its widths and heights."""
        width, height = self.size
        return (self.left + self.right) / (2 * width), (self.bottom + self.top) / (2 * height)


def window(projection, region):
    """The window of a projection matrix (4, 4) and a region of the picture: (x0, x1, y0, y1) as fractions, bottom up."""
    is_flat = projection[3][3] == 1.0
    at = lambda axis, fraction: (
        ((2 * fraction - 1 - projection[axis][3]) if is_flat else (2 * fraction - 1 + projection[axis][2]))
        / projection[axis][axis]
    )
    x0, x1, y0, y1 = region
    return Window(at(0, x0), at(0, x1), at(1, y0), at(1, y1))


def camera(eye, depsgraph, settings, region, turn, notes):
    """The camera of a render, in a world that the matrix `turn` (3, 3) turns. Raises Unsupported."""
    data = eye.data
    if data.type == "PANO":
        raise Unsupported(f"The camera {eye.name} is panoramic; use a perspective or orthographic one.")
    scale = settings.resolution_percentage / 100
    projection = eye.calc_matrix_camera(
        depsgraph,
        x=int(settings.resolution_x * scale),
        y=int(settings.resolution_y * scale),
        scale_x=settings.pixel_aspect_x,
        scale_y=settings.pixel_aspect_y,
    )
    if settings.pixel_aspect_x != settings.pixel_aspect_y:
        notes.add("pixels that are not square", "Output")
    seen = window(projection, region)
    place = np.array(eye.matrix_world.normalized(), np.float64)
    origin, forward, up = turn @ place[:3, 3], -(turn @ place[:3, 2]), turn @ place[:3, 1]
    # Far from the origin, a near target would lose digits.
    target = origin + forward * max(1.0, float(np.linalg.norm(origin)))
    common = {"origin": origin, "target": target, "up": up, "shift": seen.shift}
    _, height = seen.size
    if data.type == "ORTHO":
        if data.dof.use_dof:
            notes.add("depth of field of orthographic cameras", eye.name)
        return dl.Camera(**common, ortho=height)
    lens = depth_of_field(eye, depsgraph, -place[:3, 2], notes) if data.dof.use_dof else {}
    return dl.Camera(**common, **lens, fov=2 * math.degrees(math.atan(height / 2)))


def depth_of_field(eye, depsgraph, forward, notes):
    """Aperture and focus of a camera, with the focal length in mm."""
    dof = eye.data.dof
    distance = dof.focus_distance
    if dof.focus_object is not None:
        focus = np.array(dof.focus_object.evaluated_get(depsgraph).matrix_world.translation)
        distance = abs(float((focus - np.array(eye.matrix_world.translation)) @ forward))
    if dof.aperture_ratio != 1.0:
        notes.add("anamorphic apertures", eye.name)
    if dof.aperture_blades >= 3 and dof.aperture_rotation:
        notes.add("rotated apertures", eye.name)
    radius = 1e-3 * eye.data.lens / (2 * max(dof.aperture_fstop, 1e-5))
    return {"aperture": radius, "focus_distance": max(distance, 1e-6), "blades": dof.aperture_blades}
