"""The probe whose irradiance is known: a red, a green and a blue lamp over a smooth base.

The base is L(w) = a + b·w + w·Q·w per channel with Q symmetric and without trace, so its irradiance
is π a + 2π/3 b·n + π/4 n·Q·n exactly (Ramamoorthi & Hanrahan 2001) and nine spherical harmonics hold
it. No rotation or mirror image of it is itself. World: right-handed, +Y up.
"""

import numpy as np

HEIGHT = 512
LAMP_RADIUS = np.radians(3.0)


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


# Toward each lamp, and what a surface that faces it receives.
LAMPS = [
    (unit([0.80, 0.35, 0.45]), np.array([3.0, 0.0, 0.0])),
    (unit([-0.35, 0.85, -0.30]), np.array([0.0, 2.0, 0.0])),
    (unit([-0.25, -0.30, 0.90]), np.array([0.0, 0.0, 4.0])),
]

# One row a channel.
A = np.array([0.50, 0.40, 0.45])
B = np.array([[0.20, 0.05, -0.08], [-0.06, 0.18, 0.10], [0.05, -0.12, -0.15]])
Q = np.array(
    [
        [[0.06, 0.05, 0.02], [0.05, -0.10, -0.03], [0.02, -0.03, 0.04]],
        [[-0.05, -0.02, 0.06], [-0.02, 0.08, 0.04], [0.06, 0.04, -0.03]],
        [[0.02, 0.04, -0.05], [0.04, 0.06, 0.03], [-0.05, 0.03, -0.08]],
    ]
)


def directions(width, height, sub=1):
    """World directions of (sub-)texel centers, (height·sub, width·sub, 3), and their solid angles."""
    theta_edges = np.pi * np.arange(height * sub + 1) / (height * sub)
    cos = np.cos(theta_edges)
    omega = (cos[:-1] - cos[1:]) * 2 * np.pi / (width * sub)
    theta = np.pi * (np.arange(height * sub) + 0.5) / (height * sub)
    phi = 2 * np.pi * ((np.arange(width * sub) + 0.5) / (width * sub) - 0.5)
    sin, cos = np.sin(theta)[:, None], np.cos(theta)[:, None]
    d = np.stack(
        [np.sin(phi)[None] * sin, np.broadcast_to(cos, (len(theta), len(phi))), -np.cos(phi)[None] * sin], -1
    )
    return d, np.broadcast_to(omega[:, None], d.shape[:2])


def base(w):
    """Radiance of the base toward the unit vectors `w`."""
    return A + w @ B.T + np.einsum("...i,cij,...j->...c", w, Q, w)


def base_irradiance(n):
    """Irradiance from the base on a surface of normal `n`."""
    return (
        np.pi * A + 2 * np.pi / 3 * (n @ B.T) + np.pi / 4 * np.einsum("...i,cij,...j->...c", n, Q, n)
    )


def image():
    """The lat-long picture, (HEIGHT, 2 HEIGHT, 3), its lamps' sums exact."""
    sub, height, width = 4, HEIGHT, 2 * HEIGHT
    d, omega = directions(width, height)
    picture = base(d)
    fine, _ = directions(width, height, sub)
    for toward, irradiance in LAMPS:
        inside = (fine @ toward > np.cos(LAMP_RADIUS)).astype(float)
        coverage = inside.reshape(height, sub, width, sub).mean((1, 3))
        picture += coverage[..., None] * (irradiance / (coverage * omega).sum())
    return picture


def write_pfm(path, picture):
    with open(path, "wb") as file:
        file.write(b"PF\n%d %d\n-1.0\n" % (picture.shape[1], picture.shape[0]))
        file.write(np.ascontiguousarray(picture[::-1], "<f4").tobytes())


def read_pfm(path):
    with open(path, "rb") as file:
        kind, size, scale = (file.readline().split() for _ in range(3))
        assert kind == [b"PF"], f"{path} has no color"
        width, height = map(int, size)
        order = "<f4" if float(scale[0]) < 0 else ">f4"
        return np.frombuffer(file.read(), order).reshape(height, width, 3)[::-1].astype(float)
