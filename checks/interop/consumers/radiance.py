"""Radiance's oconv and rpict render the sphere under the rig; pyradiance brings the programs."""

import os
import pathlib
import subprocess

import mitsuba as mi
import numpy as np
import pyradiance

import reference

HOME = pathlib.Path(pyradiance.__file__).parent
ENVIRONMENT = dict(
    os.environ, PATH=f"{HOME / 'bin'}{os.pathsep}{os.environ['PATH']}", RAYPATH=f".{os.pathsep}{HOME / 'lib'}"
)
VERSION = subprocess.run(
    ["rtrace", "-version"], env=ENVIRONMENT, capture_output=True, text=True, check=True
).stdout.split()[1]

# White and matte; Z-up.
SPHERE = "void plastic white 0 0 5 1 1 1 0 0\nwhite sphere ball 0 0 4 0 0 0 1\n"


def render(rig, view, dome):
    folder, side = rig.parent, reference.VIEWS[view]
    (folder / "sphere.rad").write_text(SPHERE)
    octree = subprocess.run(
        ["oconv", "sphere.rad", rig.name], cwd=folder, env=ENVIRONMENT, capture_output=True, check=True
    ).stdout
    (folder / "scene.oct").write_bytes(octree)
    fine = 2 if dome else 4
    size = fine * reference.SIZE
    camera = f"-vtl -vp 0 {-5 * side} 0 -vd 0 {side} 0 -vu 0 0 1 -vh 2 -vv 2 -x {size} -y {size}"
    # -aa 0 gathers the dome anew at each pixel.
    quality = "-w -ps 1 -pj 0 -dj 0 -dt 0 -ar 0 -lw 0 -aa 0 " + ("-ab 1 -ad 256" if dome else "-ab 0")
    picture = subprocess.run(
        ["rpict", *camera.split(), *quality.split(), "scene.oct"],
        cwd=folder, env=ENVIRONMENT, capture_output=True, check=True,
    ).stdout
    path = folder / f"radiance-{view}.hdr"
    path.write_bytes(picture)
    picture = np.array(mi.Bitmap(str(path)), float)[..., :3]
    return picture.reshape(reference.SIZE, fine, reference.SIZE, fine, 3).mean((1, 3))


def trace(rig, directions):
    """Radiance from these directions, (n, 3) over the world's axes."""
    # A leading ! or - would be a command or an option.
    octree = subprocess.run(
        ["oconv", f"./{rig.name}"], cwd=rig.parent, env=ENVIRONMENT, capture_output=True, check=True
    ).stdout
    (rig.parent / "dome.oct").write_bytes(octree)
    rays = "".join(f"0 0 0 {x:.9f} {y:.9f} {z:.9f}\n" for x, y, z in directions)
    traced = subprocess.run(
        ["rtrace", "-h", "-w", "-ab", "0", "dome.oct"],
        cwd=rig.parent, env=ENVIRONMENT, input=rays.encode(), capture_output=True, check=True,
    ).stdout
    return np.array([line.split() for line in traced.decode().splitlines() if line.strip()], float)
