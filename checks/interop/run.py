"""Exports rigs of the known probe by `domelight lights` and has each consumer show what it reads.

Prints a row for each consumer and check, writes the pictures side by side to out/sheet.png, and
exits with 1 if a check fails, or with --ci if one could not be run. --write puts what was proved into docs/rigs.md and
docs/ibl.md.
"""

import argparse
import contextlib
import csv
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import zlib

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE / "consumers")]

import balls
import debug_probe
import mitsuba3
import probe
import proofs
import radiance
import readers
import reference
import usd

OUT = HERE / "out"
DOMELIGHT = os.environ["DOMELIGHT"]
FORMATS = ["json", "csv", "gltf", "glb", "usda", "py", "xml", "pbrt", "js", "rad", "ibl"]
FORMATS += ["tscn", "unreal.py", "cs", "rs", "babylon.js"]
# Rigs by name: how `domelight lights` is called, the up axis, the rotation [degrees].
RIGS = {
    "lamps": (["--lamps", "3"], "y", 40.0),
    "lamps-z-up": (["--lamps", "3"], "z", -25.0),
    # Regions take all light: many lights, wide discs, no dome.
    "regions": (["-n", "16"], "y", 0.0),
}


class Table:
    """The checks and the pictures."""

    def __init__(self):
        self.rows, self.pictures = [], []
        self.proofs, self.subject = proofs.Proofs(), None
        self.row("consumer", "check", "measured", "limit", "")

    def row(self, *cells):
        """Prints at once: some checks take a while."""
        self.rows.append(cells)
        print("  ".join(c.ljust(w) for c, w in zip(cells, (40, 58, 36, 9, 7), strict=True)).rstrip(), flush=True)

    @contextlib.contextmanager
    def proving(self, page, program, *files):
        """What the checks inside prove: files, which a page of docs describes, in a program."""
        self.subject = (page, program, files)
        try:
            yield
        finally:
            self.subject = None

    def prove(self, quantity, measured, text):
        if self.subject:
            page, program, files = self.subject
            for file in files:
                self.proofs.add(page, file, program, quantity, measured, text)

    def check(self, consumer, what, measured, limit, unit=1.0, text="{:.3f} %"):
        ok = bool(measured <= limit)
        show = text.format(100 * measured * unit)
        self.row(consumer, what, show, text.format(100 * limit * unit), "ok" if ok else "FAILED")
        self.prove(what.split(": ")[-1], measured, show)

    def count(self, consumer, what, measured, limit=0):
        state = "ok" if measured <= limit else "FAILED"
        self.row(consumer, what, str(measured), str(limit), state)
        self.prove("no errors", 0, "")

    def failed(self, consumer, what, error):
        lines = str(error).strip().splitlines() or [type(error).__name__]
        self.row(consumer, what, lines[-1][:100], "", "FAILED")

    def not_run(self, consumer, what, why):
        self.row(consumer, what, why, "", "not run")

    def compare(self, consumer, rig, view, picture, expected, limit):
        """A picture with what it must be: RMS difference."""
        rms, worst = reference.distance(picture, expected, view)
        self.row(
            consumer,
            f"{rig.name}, {view}: sphere",
            f"{100 * rms:.2f} % (worst pixel {100 * worst:.1f} %)",
            f"{100 * limit:.1f} %",
            "ok" if rms <= limit else "FAILED",
        )
        self.prove("a white sphere, RMS", rms, f"{100 * rms:.2f} %")
        self.pictures.append((expected, picture))

    def write_sheet(self, path, columns=4):
        """Pictures in threes: what it must be, what it is, ten times the difference."""
        cells = []
        for expected, picture in self.pictures:
            difference = np.abs(picture - expected) * 10
            row = [np.nan_to_num(p) for p in (expected, picture, difference)]
            cells.append(np.pad(np.concatenate(row, 1), ((2, 2), (2, 6), (0, 0)), constant_values=0.3))
        while len(cells) % columns:
            cells.append(np.zeros_like(cells[0]))
        sheet = np.concatenate(
            [np.concatenate(cells[i : i + columns], 1) for i in range(0, len(cells), columns)], 0
        )
        write_png(path, (255 * np.clip(0.7 * sheet, 0, 1) ** (1 / 2.2) + 0.5).astype(np.uint8))


def write_png(path, pixels):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, _ = pixels.shape
    raw = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], 1).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + data)


def domelight(*arguments):
    subprocess.run([DOMELIGHT, *map(str, arguments), "--quiet"], check=True)


class Rig:
    """A rig's files, and what our JSON says that it is, turned to +Y up."""

    def __init__(self, name):
        self.name, self.folder = name, OUT / name
        (arguments, self.up, rotation) = RIGS[name]
        self.folder.mkdir(parents=True, exist_ok=True)
        outputs = [x for e in FORMATS for x in ("-o", self.folder / f"rig.{e}")]
        if "-n" not in arguments:
            outputs += ["--keep-residual", self.folder / "residual.exr"]
        orientation = ["--env-up", self.up, "--env-rotate", rotation]
        domelight("lights", OUT / "probe.pfm", *arguments, *orientation, *outputs)
        self.json = json.loads(self.file("json").read_text())
        world_to_y_up = np.eye(3) if self.up == "y" else np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
        c, s = np.cos(np.radians(rotation)), np.sin(np.radians(rotation))
        self.map_to_y_up = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        self.map_to_world = world_to_y_up.T @ self.map_to_y_up
        self.lights = [
            {
                "name": light["name"],
                "world": np.array(light["direction"]),
                "direction": world_to_y_up @ np.array(light["direction"]),
                "irradiance": np.array(light["irradiance"]),
                "angular_radius": light["angular_radius"],
            }
            for light in self.json["lights"]
        ]
        self.residual = None
        if self.json["dome"]:
            domelight("probe", self.folder / "residual.exr", "-o", self.folder / "residual.pfm")
            self.residual = probe.read_pfm(self.folder / "residual.pfm")
            self.dome = reference.environment(self.residual)
        self.expected = {
            kind: {view: reference.picture(view, self.irradiance(light), sub=2) for view in reference.VIEWS}
            for kind, light in [
                ("parallel", reference.parallel(self.lights)),
                ("discs", reference.discs(self.lights, np.pi / 2)),
            ]
        }

    def file(self, extension):
        return self.folder / f"rig.{extension}"

    def irradiance(self, lights):
        """Of lights and dome, over normals of a world with +Y up."""
        if self.residual is None:
            return lights
        return lambda n: lights(n) + self.dome(n @ self.map_to_y_up)

    def texel_directions(self, rows=16):
        """u, v over the dome's picture and their directions in the world of the rig."""
        d, _ = probe.directions(2 * rows, rows)
        v, u = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(2 * rows) + 0.5) / (2 * rows), indexing="ij")
        return u.ravel(), v.ravel(), d.reshape(-1, 3) @ self.map_to_world.T

    def radiance(self, directions):
        """Of the dome toward directions in the world of the rig, from the nearest texel."""
        x, y, z = (directions @ self.map_to_world).T
        height, width, _ = self.residual.shape
        u = np.arctan2(x, -z) / (2 * np.pi) + 0.5
        v = np.arctan2(np.hypot(x, z), y) / np.pi
        column = np.minimum((u * width).astype(int), width - 1)
        return self.residual[np.minimum((v * height).astype(int), height - 1), column]


def angle(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def check_domelight(table, rigs):
    """Our own renderer, and the rig against the lamps that were put into the probe."""
    lamps = rigs["lamps"]
    found = [min(lamps.lights, key=lambda l, e=e: abs(l["irradiance"] - e).max()) for _, e in probe.LAMPS]
    directions = [lamps.map_to_y_up @ toward for toward, _ in probe.LAMPS]
    with table.proving("rigs", "Python's json, the lamps of the probe", ".json"):
        worst = max(angle(l["direction"], d) for l, d in zip(found, directions, strict=True))
        table.check("domelight lights", "lamps: directions", worst, 0.1, 0.01, "{:.4f}°")
        off = max(abs(l["irradiance"] - e).max() / e.max() for l, (_, e) in zip(found, probe.LAMPS, strict=True))
        table.check("domelight lights", "lamps: irradiance", off, 0.02)
    camera = ["--target", "0,0,0", "--size", f"{reference.SIZE}x{reference.SIZE}", "--filter", "box"]
    camera += ["--material", "diffuse:1", "--hide-env"]
    for rig, light, expected in [
        (lamps, ["--strategy", "mis", "--spp", "1024"], "discs"),
        (rigs["regions"], ["--strategy", "variance-minimization:lights=16", "--spp", "64"], "parallel"),
    ]:
        _, _, rotation = RIGS[rig.name]
        for view, side in reference.VIEWS.items():
            out = rig.folder / f"ours-{view}.pfm"
            eye = f"0,0,{4 * side:.0f}"
            environment = ["--env", OUT / "probe.pfm", "--env-rotate", rotation]
            domelight("render", "sphere-orthographic", *environment, *light, *camera, "--origin", eye, "-o", out)
            picture = probe.read_pfm(out)
            rig.ours = {**getattr(rig, "ours", {}), view: picture}
            table.compare("domelight render", rig, view, picture, rig.expected[expected][view], 0.01)


def check_csv(table, rigs):
    with table.proving("rigs", "Python's csv", ".csv"):
        for rig in rigs.values():
            with rig.file("csv").open(newline="") as file:
                rows = list(csv.DictReader(file))
            number = lambda row, *names: np.array([float(row[name]) for name in names])
            pairs = list(zip(rig.lights, rows, strict=True))
            off = max(angle(light["world"], number(row, "x", "y", "z")) for light, row in pairs)
            table.check("a table", f"{rig.name}: directions", off, 1e-3, 0.01, "{:.5f}°")
            off = max(
                abs(light["irradiance"] - number(row, "red", "green", "blue")).max() / light["irradiance"].max()
                for light, row in pairs
            )
            table.check("a table", f"{rig.name}: irradiance", off, 1e-6, text="{:.4f} %")


def check_mitsuba(table, rigs):
    name = f"Mitsuba {mitsuba3.VERSION}"
    for rig in [rigs["lamps"], rigs["regions"]]:
        for view in reference.VIEWS:
            picture = mitsuba3.render(rig.file("xml"), view, rig.residual is not None)
            with table.proving("rigs", f"{name}, rendered", ".xml"):
                table.compare(name, rig, view, picture, rig.expected["parallel"][view], 0.01)
            if rig.name == "regions":
                rms, _ = reference.distance(picture, rig.ours[view], view)
                table.check(name, f"regions, {view}: sphere, against domelight render", rms, 0.01)


def check_radiance(table, rigs):
    name = f"Radiance {radiance.VERSION}"
    with table.proving("rigs", f"{name}, rendered", ".rad"):
        for rig in rigs.values():
            for view in reference.VIEWS:
                picture = radiance.render(rig.file("rad"), view, rig.residual is not None)
                table.compare(name, rig, view, picture, rig.expected["parallel"][view], 0.01)
    check_odd_dome(table)


def check_odd_dome(table):
    """A dome that is not twice as wide as high: toward the middle of each texel it has that texel's radiance."""
    folder, height, width = OUT / "odd", 50, 173
    folder.mkdir(parents=True, exist_ok=True)
    # Smooth: Radiance interpolates between texels.
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    theta, phi = np.pi * v, 2 * np.pi * (u - 0.5)
    wave = np.stack([np.sin(phi), np.cos(phi), np.cos(2 * phi)], -1) * np.sin(theta)[..., None]
    texels = (1 + 0.5 * wave + 0.2 * np.cos(theta)[..., None]).astype(np.float32)
    texels[20:22, 70:72] = 400.0
    probe.write_pfm(folder / "odd.pfm", texels)
    outputs = ["-o", folder / "rig.rad", "-o", folder / "rig.json", "--keep-residual", folder / "residual.exr"]
    world = ["--env-mapping", "lat-long", "--env-up", "z", "--env-rotate", "25"]
    domelight("lights", folder / "odd.pfm", "--lamps", "1", *world, *outputs)
    domelight("probe", folder / "residual.exr", "--mapping", "lat-long", "-o", folder / "residual.pfm")
    residual = probe.read_pfm(folder / "residual.pfm")
    lamp = np.array(json.loads((folder / "rig.json").read_text())["lights"][0]["direction"])
    # The middle column looks toward +Y, and u grows to the right as seen from inside.
    phi -= np.radians(25)
    world = np.stack([np.sin(theta) * np.sin(phi), np.sin(theta) * np.cos(phi), np.cos(theta)], -1)
    seen = world @ lamp < np.cos(np.radians(12))
    read = radiance.trace(folder / "rig.rad", world[seen])
    off = np.abs(read - residual[seen]).max() / residual[seen].max()
    # Radiance's interpolation is half a texel off: 0.5 · 2 · 2π/173 · ½ of the greatest radiance.
    table.check(f"Radiance {radiance.VERSION}", f"a dome of {width}x{height}: radiance of its texels", off, 0.02)


def check_usd(table, rigs):
    name = f"OpenUSD {usd.VERSION}"
    with table.proving("rigs", f"{name}, opened", ".usda"):
        for rig in rigs.values():
            check_stage(table, name, rig)


def check_stage(table, name, rig):
    path = rig.file("usda")
    errors = usd.errors(path)
    for error in errors:
        print(f"{name}: {error}", file=sys.stderr)
    table.count(name, f"{rig.name}: errors of the schema's validators", len(errors))
    read = usd.lights(path)
    assert set(read) == {light["name"] for light in rig.lights}
    table.count(name, f"{rig.name}: up axis is not the rig's", int(usd.up_axis(path).lower() != rig.up))
    pairs = [(light, *read[light["name"]]) for light in rig.lights]
    off = max(angle(light["world"], d) for light, d, _, _ in pairs)
    table.check(name, f"{rig.name}: directions", off, 1e-3, 0.01, "{:.5f}°")
    off = max(abs(e - light["irradiance"]).max() / e.max() for light, _, e, _ in pairs)
    table.check(name, f"{rig.name}: radiance times solid angle", off, 1e-4, text="{:.4f} %")
    off = max(abs(a - min(light["angular_radius"], np.pi / 2)) for light, _, _, a in pairs)
    table.check(name, f"{rig.name}: angular radius", np.degrees(off), 1e-3, 0.01, "{:.5f}°")
    if rig.residual is not None:
        texture, direction = usd.dome(path)
        table.count(name, f"{rig.name}: dome's texture not found", int(not os.path.isfile(texture)))
        u, v, world = rig.texel_directions()
        off = np.linalg.norm(direction(u, v) - world, axis=1).max()
        table.check(name, f"{rig.name}: directions of the dome's texels", np.degrees(off), 1e-3, 0.01, "{:.5f}°")


def check_gltf(table, rigs):
    files = [rig.file(e) for rig in rigs.values() for e in ("gltf", "glb")]
    done = subprocess.run(
        ["node", HERE / "web" / "validate.mjs", *files], capture_output=True, text=True, check=True
    )
    result = json.loads(done.stdout)
    for file, report in result["reports"].items():
        name = f"gltf-validator {result['version']}"
        path = pathlib.Path(file)
        what = f"{path.parent.name}: errors and warnings in {path.name}"
        with table.proving("rigs", f"{name}, opened", path.suffix):
            table.count(name, what, report["errors"] + report["warnings"])


def check_web(table, rigs):
    jobs = []
    for rig in rigs.values():
        calls = [("three", "module", "js"), ("three", "gltf", "glb"), ("three", "gltf", "gltf")]
        if rig.residual is not None:
            calls += [("three", "dome", "js"), ("three", "rig", "js"), ("babylon", "gltf", "glb")]
            # The shader of many lights takes Babylon.js minutes to compile without a graphics card.
            calls += [("babylon", "module", "babylon.js"), ("babylon", "rightHanded", "babylon.js")]
        for page, call, extension in calls:
            for view in reference.VIEWS:
                out = rig.folder / f"{page}-{call}-{extension}-{view}.raw"
                job = {"page": page, "call": call, "rig": f"{rig.name}/rig.{extension}", "view": view, "out": str(out)}
                jobs.append((rig, job))
    path = OUT / "jobs.json"
    path.write_text(json.dumps({"size": reference.SIZE, "folder": str(OUT), "jobs": [job for _, job in jobs]}))
    done = subprocess.run(["node", HERE / "web" / "render.mjs", path], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    versions = json.loads(done.stdout)
    names = {
        ("three", "module"): f"three.js {versions['three']}, module",
        ("three", "dome"): f"three.js {versions['three']}, module with setDome",
        ("three", "rig"): f"three.js {versions['three']}, module with its dome",
        ("three", "gltf"): f"three.js {versions['three']}, GLTFLoader",
        ("babylon", "gltf"): f"Babylon.js {versions['babylon']}, glTF",
        ("babylon", "module"): f"Babylon.js {versions['babylon']}, module",
        ("babylon", "rightHanded"): f"Babylon.js {versions['babylon']}, module, right-handed",
    }
    for rig, job in jobs:
        page, call, view = job["page"], job["call"], job["view"]
        pixels = np.fromfile(job["out"], "<f4").reshape(reference.SIZE, reference.SIZE, 4)[::-1, :, :3]
        expected = rig.expected["parallel"][view]
        name = names[page, call]
        if (page, call) == ("three", "gltf"):
            # GLTFLoader passes over the image-based light.
            expected = reference.picture(view, reference.parallel(rig.lights), sub=2)
            name += " " + job["rig"].split(".")[-1]
        file = "." + job["rig"].split(".", 1)[1]
        with table.proving("rigs", f"{name.split(',')[0]}, rendered", file):
            table.compare(name, rig, view, pixels.astype(float), expected, 0.01)


def check_blender(table, rigs):
    script = HERE / "consumers" / "blender_scene.py"
    for rig in rigs.values():
        for view in reference.VIEWS:
            # Once as a script, once line by line as in the console.
            how = [] if view == "front" else ["paste"]
            out = rig.folder / f"blender-{view}.npy"
            command = [sys.executable, script, "rig.py", out, view, reference.SIZE, 1024, *how]
            done = subprocess.run(list(map(str, command)), cwd=rig.folder, capture_output=True, text=True)
            if done.returncode:
                raise RuntimeError(done.stderr)
            read = json.loads(out.with_suffix(".json").read_text())
            name = f"Blender {read['version']}, " + ("script" if view == "front" else "pasted")
            with table.proving("rigs", f"Blender {read['version']}, rendered", ".py"):
                table.compare(name, rig, view, np.load(out), rig.expected["discs"][view], 0.01)
            dome = int(rig.residual is not None)
            once = {"suns": len(rig.lights), "collections": 1, "worlds": dome, "pictures": dome}
            for what, n in once.items():
                table.count(name, f"{rig.name}: run twice, {what} too many", abs(read["counts"][what] - n))
        z_up = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        pairs = [(light, read["lights"][light["name"]]) for light in rig.lights]
        with table.proving("rigs", f"Blender {read['version']}, rendered", ".py"):
            off = max(angle(z_up @ light["direction"], np.array(sun["toward"])) for light, sun in pairs)
            table.check(name, f"{rig.name}: directions", off, 1e-3, 0.01, "{:.5f}°")
            off = max(abs(sun["angle"] / 2 - min(light["angular_radius"], np.pi / 2)) for light, sun in pairs)
            table.check(name, f"{rig.name}: angular radius", np.degrees(off), 1e-3, 0.01, "{:.5f}°")


def check_readers(table, rigs):
    for rig in rigs.values():
        with table.proving("rigs", "a reader for pbrt-v4", ".pbrt"):
            check_pbrt(table, rig)
        with table.proving("rigs", "a reader for sIBL", ".ibl"):
            check_sibl(table, rig)


def check_pbrt(table, rig):
    name = "pbrt-v4, a reader, not the program"
    lights, file, world_from_light = readers.pbrt(rig.file("pbrt"))
    off = max(angle(light["world"], d) for light, (d, _) in zip(rig.lights, lights, strict=True))
    table.check(name, f"{rig.name}: directions", off, 1e-3, 0.01, "{:.5f}°")
    off = max(abs(light["irradiance"] - e).max() for light, (_, e) in zip(rig.lights, lights, strict=True))
    table.check(name, f"{rig.name}: irradiance", off, 1e-6, text="{:.4f} %")
    if rig.residual is not None:
        octahedral = np.array(mitsuba3.mi.Bitmap(str(rig.folder / file)), float)[..., :3]
        assert octahedral.shape[0] == octahedral.shape[1]
        _, _, world = rig.texel_directions()
        u, v = readers.equal_area_square(world @ world_from_light)
        size = octahedral.shape[0]
        read = octahedral[np.minimum((v * size).astype(int), size - 1), np.minimum((u * size).astype(int), size - 1)]
        expected = rig.radiance(world)
        off = np.sqrt(((read - expected) ** 2).mean() / (expected**2).mean())
        table.check(name, f"{rig.name}: radiance of the dome", off, 0.01)


def check_sibl(table, rig):
    name = "sIBL, a reader, not a program"
    lights, file = readers.sibl(rig.file("ibl"))
    worst, strength = 0.0, 0.0
    for light, (u, v, color) in zip(rig.lights, lights, strict=True):
        theta, phi = np.pi * v, 2 * np.pi * (u - 0.5)
        toward = [np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)]
        worst = max(worst, angle(rig.map_to_world @ np.array(toward), light["world"]))
        strength = max(strength, abs(color * np.pi - light["irradiance"]).max() / light["irradiance"].max())
    table.check(name, f"{rig.name}: places of the lights", worst, 1e-3, 0.01, "{:.5f}°")
    table.check(name, f"{rig.name}: colors, of 8 bits", strength, 0.5 / 255 + 1e-6)
    if rig.residual is not None:
        table.count(name, f"{rig.name}: panorama not found", int(not (rig.folder / file).is_file()))


def check_balls(table):
    """Prefiltered light in the engines that read it, beside our own render."""
    folder = OUT / "balls"
    ours = balls.prepare(domelight, folder)
    command = ["node", HERE / "web" / "balls.mjs", folder, balls.N * balls.SIZE, balls.SIZE, json.dumps(balls.FILES)]
    done = subprocess.run(list(map(str, command)), cwd=HERE, capture_output=True, text=True)
    sys.stderr.write(done.stderr)
    if done.returncode:
        raise RuntimeError(done.stderr)
    versions = json.loads(done.stdout)
    rows = []
    for engine, expected in ours.items():
        name = f"{ENGINE_NAMES[engine]} {versions[f'balls-{engine}']}"
        for file in balls.FILES[engine]:
            picture = balls.read_pixels(folder / f"{file}.f32")
            if file == balls.FILES[engine][0]:
                rows += [picture, expected]
            with table.proving("ibl", f"{name}, rendered", pathlib.Path(file).suffix):
                check_ball(table, f"{name}, {file}", picture, expected)
    sheet = np.concatenate(rows, 0)
    write_png(folder / "balls.png", (255 * np.clip(sheet, 0, 1) ** (1 / 2.2) + 0.5).astype(np.uint8))


def check_ball(table, name, picture, expected):
    """A split sum is exact in the middle of a metal; engines' white dielectrics differ."""
    for ball, middle, whole in balls.distances(picture, expected):
        kind = ball.split()[0]
        table.check(name, f"{ball}: middle of the {kind} balls", middle, balls.MIDDLE[kind])
        table.check(name, f"{ball}: whole balls, RMS", whole, balls.WHOLE)


def check_ktx2(table):
    """KTX2 files in the reader of three.js and glTF Transform, beside the pictures of the levels."""
    folder = OUT / "ktx2"
    folder.mkdir(parents=True, exist_ok=True)
    probe.write_pfm(folder / "light.pfm", balls.light())
    for texels, decode, limit in [("rgb9e5", balls.shared_exponent, 0.5 / 256), ("half", balls.half, 2.0**-11)]:
        domelight("ibl", folder / "light.pfm", "--size", "64", "--texels", texels, "-o", f"{folder}/{texels}/")
        command = ["node", HERE / "web" / "ktx2.mjs", folder / texels / "radiance.ktx2"]
        read = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        with table.proving("ibl", f"ktx-parse of three.js, opened ({texels})", ".ktx2"):
            table.count("ktx-parse", f"{texels}: not a cube of 7 levels", int([read["faces"], len(read["levels"])] != [6, 7]))
            off = 0
            for level, words in enumerate(read["levels"]):
                strip = mitsuba3.mi.Bitmap(str(folder / texels / f"radiance_{level:02}.exr"))
                expected = np.array(strip, float)[..., :3].reshape(-1, 3)
                texel = decode(words)
                off = max(off, (abs(texel - expected).max(1) / expected.max(1)).max())
            table.check("ktx-parse", f"{texels}: texels", off, limit)


def check_playcanvas(table):
    """The map of axes in PlayCanvas, as the panorama and as the cube that are written for it."""
    folder, size = OUT / "playcanvas", 256
    folder.mkdir(parents=True, exist_ok=True)
    domelight("conventions", "--size", debug_probe.ROWS, "-o", folder / "axes.pfm")
    domelight("probe", folder / "axes.pfm", "--for", "playcanvas", "-o", folder / "panorama.exr")
    # A cube shows the map as PlayCanvas shows the same file as a panorama.
    domelight("ibl", folder / "panorama.exr", "--for", "playcanvas", "-o", f"{folder}/cube/")
    axes = probe.read_pfm(folder / "axes.pfm")
    maps = {"panorama": "panorama.exr", "cube": "cube/radiance_00.exr"}
    job = {"folder": str(folder), "views": debug_probe.VIEWS, "size": size, "maps": list(maps.values())}
    (folder / "job.json").write_text(json.dumps(job))
    done = subprocess.run(["node", HERE / "web" / "look.mjs", folder / "job.json"], capture_output=True, text=True)
    sys.stderr.write(done.stderr)
    if done.returncode:
        raise RuntimeError(done.stderr)
    name = f"PlayCanvas {json.loads(done.stdout)['playcanvas']}"
    for what, file in maps.items():
        seen = np.fromfile(folder / f"{file}.f32", "<f4").reshape(6, size, size, 4)[:, ::-1, :, :3].astype(float)
        dots, sun, mean = debug_probe.distances(axes, seen)
        with table.proving("ibl", f"{name}, rendered", ".exr") if what == "cube" else contextlib.nullcontext():
            table.check(name, f"{what}: dots in 26 directions", dots, 0.005)
            table.check(name, f"{what}: sun, in texels", sun, 0.5, 0.01, "{:.3f}")
            table.check(name, f"{what}: mean", mean, 0.005)


def check_tracer(table):
    """The example that samples a map by its tables: no bias, and less noise than without them."""
    folder = OUT / "tracer"
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(HERE.parents[1] / "docs" / "examples" / "path-tracer.html", folder)
    modules = folder / "node_modules"
    if not modules.exists():
        modules.symlink_to(HERE / "node_modules")
    domelight("tables", "studio", "-o", folder / "studio.ktx2", "--snippet", "glsl")
    command = ["node", HERE / "web" / "tracer.mjs", folder, folder / "tracer.png"]
    done = subprocess.run(list(map(str, command)), cwd=HERE, capture_output=True, text=True)
    sys.stderr.write(done.stderr)
    panes = json.loads(done.stdout)
    if not isinstance(panes, list):
        raise RuntimeError(panes)
    name = "three.js, path tracing by tables"
    uniform, cosine, tables = panes
    # A pane has 96² pixels, whose errors are independent.
    for what, pane in [("uniform", uniform), ("cosine", cosine)]:
        error = np.hypot(pane["noise"] * pane["mean"], tables["noise"] * tables["mean"]) / 96
        z = abs(pane["mean"] - tables["mean"]) / error
        table.check(name, f"mean beside {what} samples, standard errors", z, 4, 0.01, "{:.2f}")
        table.check(name, f"noise over that of {what} samples", tables["noise"] / pane["noise"], 0.5, 0.01, "{:.3f}")


ENGINE_NAMES = {"three": "three.js", "babylon": "Babylon.js", "filament": "Filament"}

ENGINES = {
    "Godot 4": ("tscn", readers.godot),
    "Unreal": ("unreal.py", readers.unreal),
    "Unity": ("cs", readers.unity),
    "Bevy": ("rs", readers.bevy),
}


def check_engines(table, rigs):
    for engine, (extension, reader) in ENGINES.items():
        with table.proving("rigs", f"a reader for {engine}", f".{extension}"):
            for rig in rigs.values():
                check_engine(table, f"{engine}, a reader, not the program", rig, *reader(rig.file(extension)))


def check_engine(table, name, rig, lights, file, direction):
    pairs = list(zip(rig.lights, lights, strict=True))
    off = max(angle(light["direction"], d) for light, (d, _) in pairs)
    table.check(name, f"{rig.name}: directions", off, 1e-3, 0.01, "{:.5f}°")
    off = max(abs(light["irradiance"] - e).max() / e.max() for light, (_, e) in pairs)
    table.check(name, f"{rig.name}: irradiance", off, 1e-5, text="{:.4f} %")
    if rig.residual is None:
        return
    table.count(name, f"{rig.name}: dome's picture not found", int(not (rig.folder / file).is_file()))
    u, v, world = rig.texel_directions()
    y_up = world @ (rig.map_to_y_up @ rig.map_to_world.T).T
    off = np.linalg.norm(direction(u, v) - y_up, axis=1).max()
    table.check(name, f"{rig.name}: directions of the dome's texels", np.degrees(off), 1e-3, 0.01, "{:.5f}°")


NAMES = [
    'a "b" c', "it's", "x\\y", "a@b@", "$(touch owned)", "`touch owned`", "#hash", "a]]>b", "{{x}}", "new\nline",
    "line\u2028separator", "%s %n", "[0]", "!touch owned", "a;b", "-dash", "tab\there", "é√", '"""', "<b>&amp;",
]  # fmt: skip


def check_names(table):
    """Names that mean something in a format's language: the reader finds the lights and the dome's file, or
    `domelight lights` refuses the name."""
    folder = OUT / "names"
    folder.mkdir(parents=True, exist_ok=True)
    texels = np.full((32, 64, 3), 0.2, np.float32)
    texels[8:10, 20:22] = 400.0
    probe.write_pfm(folder / "probe.pfm", texels)

    def read_usd(path):
        return usd.lights(path), os.path.basename(usd.dome(path)[0])

    def read_pbrt(path):
        return readers.pbrt(path)[:2]

    def read_sibl(path):
        return readers.sibl(path)

    def read_radiance(path):
        assert radiance.trace(path, np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])).sum() > 0
        return [0], f"{path.stem}_dome.hdr"

    read = {
        f"OpenUSD {usd.VERSION}": ("usda", read_usd),
        f"Radiance {radiance.VERSION}": ("rad", read_radiance),
        "pbrt-v4, a reader, not the program": ("pbrt", read_pbrt),
        "sIBL, a reader, not a program": ("ibl", read_sibl),
    }
    for consumer, (extension, reader) in read.items():
        wrong, refused = [], 0
        for name in NAMES:
            rig = folder / f"{name}.{extension}"
            command = [DOMELIGHT, "lights", folder / "probe.pfm", "--lamps", "1", "-o", rig, "--quiet"]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                refused += 1
                if "cannot name the file" not in done.stderr:
                    wrong.append(f"{name!r}: {done.stderr.strip()}")
                continue
            try:
                lights, dome = reader(rig)
                if not lights or not (folder / dome).is_file():
                    wrong.append(f"{name!r}: {len(lights)} lights, dome {dome!r}")
            except Exception as error:
                wrong.append(f"{name!r}: {error!r}")
        for line in wrong:
            print(f"{consumer}: {line}", file=sys.stderr)
        table.count(consumer, f"{len(NAMES)} odd names of files, {refused} refused: not read", len(wrong))
    table.count("all", "odd names of files: commands that ran", len(list(OUT.rglob("owned"))) + os.path.exists("owned"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ci", action="store_true", help="leave Blender out; fail if anything else is not run")
    parser.add_argument("--write", action="store_true", help="write the tables in docs, if everything runs and passes")
    parser.add_argument("--only", default="", metavar="NAME", help="checks whose name contains this")
    arguments = parser.parse_args()
    OUT.mkdir(exist_ok=True)
    probe.write_pfm(OUT / "probe.pfm", probe.image())
    rigs = {name: Rig(name) for name in RIGS}

    table = Table()
    checks = [
        ("domelight", check_domelight),
        ("csv", check_csv),
        ("Mitsuba", check_mitsuba),
        ("Radiance", check_radiance),
        ("OpenUSD", check_usd),
        ("gltf-validator", check_gltf),
        ("three.js, Babylon.js", check_web),
        ("pbrt-v4, sIBL", check_readers),
        ("Godot, Unreal, Unity, Bevy", check_engines),
        ("prefiltered light in three.js, Babylon.js, Filament", lambda table, _: check_balls(table)),
        ("the map of axes in PlayCanvas", lambda table, _: check_playcanvas(table)),
        ("prefiltered light in KTX2", lambda table, _: check_ktx2(table)),
        ("path tracing by tables in three.js", lambda table, _: check_tracer(table)),
        ("names of files", lambda table, _: check_names(table)),
    ]
    for name, check in checks:
        if arguments.only.lower() not in name.lower():
            continue
        try:
            check(table, rigs)
        except Exception as error:  # A consumer that fails is a row, and the others still run.
            table.failed(name, "runs", error)
    if arguments.only.lower() not in "blender":
        pass
    elif arguments.ci:
        table.not_run("Blender", "all", "left out by --ci")
    elif subprocess.run([sys.executable, "-c", "import bpy"], capture_output=True).returncode:
        table.not_run("Blender", "all", f"no wheel for Python {sys.version.split()[0]}")
    else:
        try:
            check_blender(table, rigs)
        except Exception as error:
            table.failed("Blender", "runs", error)
    if table.pictures:
        table.write_sheet(OUT / "sheet.png")
    failed = sum(row[-1] == "FAILED" for row in table.rows)
    print(f"\n{len(table.rows) - 1} checks, {failed} failed; pictures in {OUT / 'sheet.png'}")
    if arguments.write:
        if failed or arguments.only or any(row[-1] == "not run" for row in table.rows):
            sys.exit("interop: not everything ran and passed, so docs keep their tables")
        table.proofs.write()
    sys.exit(1 if failed else 0)


main()
