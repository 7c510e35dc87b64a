"""What a white Lambert sphere under a rig must look like, and how far a picture is from it.

The unit sphere stands at the origin and fills an orthographic picture; it is seen from +Z ("front")
and from -Z ("back"), +Y up, so that every normal is seen. Pictures are radiance: irradiance / π.
"""

import numpy as np
import probe

SIZE = 64
VIEWS = {"front": 1.0, "back": -1.0}
# Pixels nearer to the silhouette than this are left out: consumers tessellate the sphere.
RIM = 0.96


def normals(view, sub=1):
    """Unit normals (SIZE·sub)² × 3; NaN beside the sphere."""
    n = SIZE * sub
    axis = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = np.meshgrid(axis, -axis)
    with np.errstate(invalid="ignore"):
        z = np.sqrt(1 - x * x - y * y)
    side = VIEWS[view]
    return np.stack([side * x, y + 0 * z, side * z], -1) + 0 * z[..., None]


def mask(view):
    axis = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    return np.hypot(*np.meshgrid(axis, axis)) < RIM


def picture(view, irradiance, sub=4):
    """The picture of a function from normals to irradiance, box-filtered over the pixel."""
    n = normals(view, sub).reshape(-1, 3)
    seen = ~np.isnan(n[:, 0])
    radiance = np.zeros((len(n), 3))
    radiance[seen] = irradiance(n[seen]) / np.pi
    return radiance.reshape(SIZE, sub, SIZE, sub, 3).mean((1, 3))


def parallel(lights):
    """Irradiance from lights of no size."""
    return lambda n: sum(
        np.maximum(n @ light["direction"], 0)[:, None] * light["irradiance"] for light in lights
    ) if lights else np.zeros_like(n)


def disc_points(direction, radius, rings=24, sectors=48):
    """Directions of equal solid angle over the cap of angular radius `radius`."""
    u, v = np.meshgrid((np.arange(rings) + 0.5) / rings, (np.arange(sectors) + 0.5) / sectors)
    cos = 1 - u.ravel() * 2 * np.sin(radius / 2) ** 2
    sin, phi = np.sqrt(np.maximum(1 - cos * cos, 0)), 2 * np.pi * v.ravel()
    x = probe.unit(np.cross(direction, [0.0, 1.0, 0.0] if abs(direction[1]) < 0.9 else [1.0, 0.0, 0.0]))
    y = np.cross(direction, x)
    return np.outer(cos, direction) + np.outer(sin * np.cos(phi), x) + np.outer(sin * np.sin(phi), y)


def discs(lights, widest=np.pi):
    """Irradiance from uniform discs that hold each light's ∫ L dω, no wider than `widest`."""

    def irradiance(n):
        total = np.zeros_like(n)
        for light in lights:
            points = disc_points(light["direction"], min(light["angular_radius"], widest))
            for part in range(0, len(n), 4096):
                cos = np.maximum(n[part : part + 4096] @ points.T, 0).mean(1)
                total[part : part + 4096] += cos[:, None] * light["irradiance"]
        return total

    return irradiance


def environment(lat_long, rows=64):
    """Irradiance from a lat-long picture, by the sum over its texels pooled to `rows` rows."""
    height, width, _ = lat_long.shape
    d, omega = probe.directions(width, height)

    def pool(values):
        blocks = values.reshape(rows, height // rows, 2 * rows, width // (2 * rows), -1)
        return blocks.sum((1, 3)).reshape(2 * rows * rows, -1)

    weight = pool(omega[..., None])
    energy = pool(lat_long * omega[..., None])
    toward = pool(d * omega[..., None]) / weight

    def irradiance(n):
        parts = [n[i : i + 2048] @ toward.T for i in range(0, len(n), 2048)]
        return np.concatenate([np.maximum(cos, 0) @ energy for cos in parts])

    return irradiance


def distance(test, expected, view):
    """RMS difference over RMS of the expected, and the greatest difference over its greatest value;
    the worst channel of each."""
    inside = mask(view)
    a, b = test[inside], expected[inside]
    rms = np.sqrt(((a - b) ** 2).mean(0)) / np.sqrt((b**2).mean(0)).max()
    worst = np.abs(a - b).max() / b.max()
    return rms.max(), worst
