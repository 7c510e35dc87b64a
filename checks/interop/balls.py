"""Six balls under light that `domelight ibl` prefiltered, in the engines that read it, beside our own render.

Metals with F0 = 1 and roughness 0, 1/4, 1/2, 3/4 and 1, and a white dielectric with roughness 1, in an
orthographic picture. Where an engine looks straight at a ball, a split sum is exact; toward the rim its
assumption that the viewer looks along the normal fails, and each engine bends the reflection in its own way.
"""

import base64
import json
import struct

import numpy as np
import probe

ROUGHNESS = [0.0, 0.25, 0.5, 0.75, 1.0]
N = len(ROUGHNESS) + 1
# Pixels of a ball, whose radius is 0.9 of a cell's.
SIZE = 128
RADIUS = 0.9

# What each engine reads.
FILES = {"three": ["three/radiance_00.exr"], "babylon": ["balls.env", "balls.dds"], "filament": ["balls.ktx"]}
# Limits of the differences from our own render. A split sum is exact in the middle of a metal; engines' dielectrics differ.
MIDDLE = {"metal": 0.02, "white": 0.04}
WHOLE = 0.08


def light(height=64):
    """A smooth map without symmetry, with a patch toward the viewer's upper left."""
    d, _ = probe.directions(2 * height, height)
    x, y, z = np.moveaxis(d, -1, 0)
    base = np.stack([0.3 + 0.2 * x + 0.08 * y * z, 0.28 + 0.18 * y - 0.08 * x * z, 0.3 - 0.2 * z + 0.1 * x * y], -1)
    patch = d @ probe.unit([-0.5, 0.55, 0.65]) > np.cos(np.radians(18))
    return np.where(patch[..., None], [0.9, 0.85, 0.6], base).astype(np.float32)


def sphere(rings=64, sectors=128):
    """Positions, which are normals, and triangles."""
    theta, phi = np.meshgrid(np.pi * np.arange(rings + 1) / rings, 2 * np.pi * np.arange(sectors + 1) / sectors, indexing="ij")
    points = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rings), np.arange(sectors), indexing="ij"))
    a, row = i * (sectors + 1) + j, sectors + 1
    quads = np.stack([a, a + row, a + row + 1, a, a + row + 1, a + 1], -1)
    return points.astype(np.float32), quads.astype(np.uint32)


LOOKS = [(1.0, roughness) for roughness in ROUGHNESS] + [(0.0, 1.0)]


def write_model(path, looks):
    """Balls side by side and the camera, as binary glTF. A look is metalness and roughness."""
    points, triangles = sphere()
    data = points.tobytes() + triangles.tobytes()
    lengths = [points.nbytes, triangles.nbytes]
    views = [{"buffer": 0, "byteOffset": sum(lengths[:i]), "byteLength": lengths[i]} for i in range(2)]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3", "min": [-1] * 3, "max": [1] * 3},
        {"bufferView": 1, "componentType": 5125, "count": triangles.size, "type": "SCALAR"},
    ]
    n = len(looks)
    materials = [{"pbrMetallicRoughness": {"metallicFactor": m, "roughnessFactor": r}} for m, r in looks]
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 0}, "indices": 1}
    nodes = [{"mesh": i, "translation": [2 * i - n + 1, 0, 0], "scale": [RADIUS] * 3} for i in range(n)]
    nodes.append({"camera": 0, "translation": [0, 0, 4]})
    model = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(n + 1))}],
        "nodes": nodes,
        "meshes": [{"primitives": [{**primitive, "material": i}]} for i in range(n)],
        "materials": materials,
        "cameras": [{"type": "orthographic", "orthographic": {"xmag": n, "ymag": 1, "znear": 0.1, "zfar": 10}}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(model).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def prepare(domelight, folder):
    """Writes model, map and prefiltered light, and returns our own picture for each engine, in which the map stands as there."""
    folder.mkdir(parents=True, exist_ok=True)
    write_model(folder / "balls.glb", LOOKS)
    # Engines cast no shadows of the map, so that each ball stands alone.
    for i, look in enumerate(LOOKS):
        write_model(folder / f"ball-{i}.glb", [look])
    probe.write_pfm(folder / "light.pfm", light())
    ours = {}
    for engine, files in FILES.items():
        for name in files:
            # A picture of a level is one file of a folder.
            out = f"{folder}/{name.split('/')[0]}" + ("/" if "/" in name else "")
            texels = ["--texels", "half"] if name.endswith(".dds") else []
            domelight("ibl", folder / "light.pfm", "--for", engine, *texels, "-o", out)
        ours[engine] = np.concatenate([ball(domelight, folder, i, engine) for i in range(N)], 1)
    return ours


def ball(domelight, folder, i, engine):
    """Our own picture of a ball."""
    out = folder / f"{engine}-{i}.pfm"
    light = ["--env", folder / "light.pfm", "--env-convention", engine, "--hide-env"]
    picture = ["--size", f"{SIZE}x{SIZE}", "--spp", 64, "--filter", "box"]
    domelight("render", folder / f"ball-{i}.glb", *light, *picture, "-o", out)
    return probe.read_pfm(out)


def shared_exponent(data):
    """Texels of RGB9E5, from base64."""
    words = np.frombuffer(base64.b64decode(data), "<u4")
    mantissas = np.stack([words >> shift & 511 for shift in (0, 9, 18)], -1)
    return mantissas * 2.0 ** ((words >> 27).astype(int)[:, None] - 24)


def half(data):
    """Texels of RGBA in half precision, from base64."""
    return np.frombuffer(base64.b64decode(data), "<f2").reshape(-1, 4)[:, :3].astype(float)


def read_pixels(path):
    """Floats as the pages write them: RGBA, rows from the bottom."""
    return np.fromfile(path, np.float32).reshape(SIZE, N * SIZE, 4)[::-1, :, :3].astype(float)


def distances(picture, ours):
    """For each ball, the difference in its middle, where a split sum is exact, and the RMS difference within its rim."""
    axis = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    r = np.hypot(*np.meshgrid(axis, axis)) / RADIUS
    middle, inside = r < 0.15, r < 0.95
    for i, name in enumerate([f"metal {r:g}" for r in ROUGHNESS] + ["white"]):
        a, b = (p[:, i * SIZE : (i + 1) * SIZE] for p in (picture, ours))
        scale = b[inside].mean()
        off = np.sqrt(((a[middle].mean(0) - b[middle].mean(0)) ** 2).mean()) / b[middle].mean()
        yield name, off, np.sqrt(((a - b)[inside] ** 2).mean()) / scale
