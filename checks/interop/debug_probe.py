"""The map of `domelight conventions` as a program shows it: the colors of its 26 dots, its sun, and its mean.

The pictures show the whole sphere in six views of 90°. Directions are those of domelight's world, in which the program's map
stands as the scene does.
"""

import numpy as np

ROWS = 256
# Radians: the radius of a dot and a bit less, and of what is left out around the sun.
INSIDE, GLARE = 0.12, 0.06

VIEWS = [
    ([0, 0, -1], [0, 1, 0]),
    ([1, 0, 0], [0, 1, 0]),
    ([0, 0, 1], [0, 1, 0]),
    ([-1, 0, 0], [0, 1, 0]),
    ([0, 1, 0], [0, 0, 1]),
    ([0, -1, 0], [0, 0, -1]),
]


def directions(size):
    """Unit vectors of the pixels, (6, size, size, 3), rows from the top, and their solid angles up to a factor."""
    along = (2 * np.arange(size) + 1) / size - 1
    s, t = np.meshgrid(along, -along)
    views = [np.array(forward) + s[..., None] * np.cross(forward, up) + t[..., None] * np.array(up) for forward, up in VIEWS]
    length = np.sqrt(1 + s**2 + t**2)
    return np.stack(views) / length[..., None], np.broadcast_to(length**-3, (6, size, size))


def texels(picture, d):
    """Of a lat-long map of domelight toward directions."""
    height, width, _ = picture.shape
    u = np.arctan2(d[..., 0], -d[..., 2]) / (2 * np.pi) + 0.5
    v = np.arctan2(np.hypot(d[..., 0], d[..., 2]), d[..., 1]) / np.pi
    row, column = (v * height).astype(int), (u * width).astype(int)
    return picture[np.minimum(row, height - 1), np.minimum(column, width - 1)]


def sun_of(picture):
    """The direction of the brightest texel."""
    height, width, _ = picture.shape
    row, column = divmod(int(picture[..., 1].argmax()), width)
    theta, phi = np.pi * (row + 0.5) / height, 2 * np.pi * ((column + 0.5) / width - 0.5)
    return np.array([np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)])


def distances(picture, shown):
    """Of six views of a map: the largest relative error of the 26 dots, the distance of the sun in texels, and the relative
    error of the mean without the sun."""
    d, weights = directions(shown.shape[1])
    sun = sun_of(picture)
    dots = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z]
    off = []
    for x, y, z in dots:
        # Dots stand at multiples of 45° of longitude and latitude.
        across = np.hypot(x, z)
        dot = np.array([x, y * max(across, 1e-9), z]) if across else np.array([x, y, z])
        inside = d @ (dot / np.linalg.norm(dot)) > np.cos(INSIDE)
        exact = texels(picture, dot / np.linalg.norm(dot))
        off.append(np.abs(np.median(shown[inside], 0) - exact).max() / exact.max())
    bright = shown[..., 1] > 20
    middle = (d[bright] * (weights * shown[..., 1])[bright][:, None]).sum(0)
    angle = np.arccos(np.clip(middle @ sun / np.linalg.norm(middle), -1, 1)) if bright.any() else np.pi
    dark = d @ sun < np.cos(GLARE)
    mean = lambda values: (values * weights[..., None])[dark].sum(0) / weights[dark].sum()
    exact = mean(texels(picture, d))
    return max(off), angle / (np.pi / picture.shape[0]), np.abs(mean(shown) / exact - 1).max()
