"""Readers written from the documentation of formats whose programs cannot be had here.

pbrt-v4 (its file format guide and `EqualAreaSphereToSquare`, after Clarberg 2008), sIBL (HDR Labs' format
specification), and the engines Godot, Unreal, Unity and Bevy (their documentation and shaders, which the comments of
`crates/domelight/src/rig/export/` name). They prove less than a program would.

Readers of engines return lights (direction, irradiance), the dome's file and a function from places on its picture to
directions. Directions are those of a right-handed world with +Y up.
"""

import ast
import configparser
import re

import numpy as np

import probe


def pbrt(path):
    """Distant lights (direction, irradiance), the infinite light's file and its world-from-light."""
    # Comments end at line breaks; a # in a string begins none.
    tokens = re.findall(r'"(?:[^"\\]|\\.)*"|#.*|\[|\]|[^\s\[\]"]+', path.read_text())
    tokens = [token for token in tokens if not token.startswith("#")]
    lights, file, matrix, stack, at = [], None, np.eye(4), [], 0

    def bracket():
        nonlocal at
        assert tokens[at] == "[", tokens[at]
        end = tokens.index("]", at)
        values, at = tokens[at + 1 : end], end + 1
        return values

    while at < len(tokens):
        directive = tokens[at]
        at += 1
        if directive == "AttributeBegin":
            stack.append(matrix)
        elif directive == "AttributeEnd":
            matrix = stack.pop()
        elif directive == "ConcatTransform":
            matrix = matrix @ np.array(bracket(), float).reshape(4, 4).T
        elif directive == "LightSource":
            kind, parameters = tokens[at].strip('"'), {}
            at += 1
            while at < len(tokens) and tokens[at].startswith('"'):
                name = tokens[at].strip('"')
                at += 1
                parameters[name] = bracket()
            if kind == "distant":
                toward = np.array(parameters["point3 from"], float) - np.array(parameters["point3 to"], float)
                lights.append((probe.unit(matrix[:3, :3] @ toward), np.array(parameters["rgb L"], float)))
            else:
                assert kind == "infinite", kind
                file, world_from_light = unescaped(parameters["string filename"][0]), matrix[:3, :3]
        else:
            raise ValueError(f"{path}: {directive}?")
    assert not stack
    return lights, file, world_from_light if file else None


def unescaped(string):
    """The text of a string in double quotes, as pbrt-v4 reads its escapes."""
    named = {"b": "\b", "f": "\f", "n": "\n", "r": "\r", "t": "\t"}
    return re.sub(r"\\(.)", lambda m: named.get(m[1], m[1]), string[1:-1], flags=re.DOTALL)


def equal_area_square(w):
    """u, v of directions in pbrt's light space."""
    x, y, z = np.abs(w).T
    r = np.sqrt(np.maximum(1 - z, 0))
    phi = np.arctan2(y, x) * 2 / np.pi
    v = phi * r
    u = r - v
    below = w[:, 2] < 0
    u, v = np.where(below, 1 - v, u), np.where(below, 1 - u, v)
    u, v = np.copysign(u, w[:, 0]), np.copysign(v, w[:, 1])
    return (u + 1) / 2, (v + 1) / 2


def sibl(path):
    """Lights (u, v, color times multiplier) and the panorama's file."""
    ibl = configparser.RawConfigParser(inline_comment_prefixes=None, comment_prefixes=("--",))
    ibl.read_string(path.read_text())
    lights = []
    for section in ibl.sections():
        prefix = "SUN" if section == "Sun" else "LIGHT" if section.startswith("Light") else None
        if prefix:
            values = ibl[section]
            color = np.array(values[prefix + "color"].split(","), float) / 255
            u, v = float(values[prefix + "u"]), float(values[prefix + "v"])
            lights.append((u, v, color * float(values[prefix + "multi"])))
    file = ibl["Enviroment"]["EVfile"][1:-1] if "Enviroment" in ibl else None
    return lights, file


def numbers(text):
    return np.array([float(number) for number in re.findall(r"[-+]?[\d.]+(?:e[-+]?\d+)?", text)])


def godot(path):
    """A scene: lights shine along −Z, colors are sRGB, π times energy is irradiance; the panorama's left edge is at −Z."""
    text = path.read_text()
    lights = []
    for node in text.split("[node ")[1:]:
        values = dict(line.split(" = ", 1) for line in node.splitlines() if " = " in line)
        if "transform" not in values:
            continue
        basis = numbers(values["transform"].replace("Transform3D", ""))[:9].reshape(3, 3)
        encoded = numbers(values["light_color"])[:3]
        color = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        energy = float(values["light_energy"])
        assert abs(float(values["light_intensity_lux"]) / (683 * np.pi) - 1) < 1e-6
        lights.append((basis[:, 2], np.pi * energy * color))
    file = re.search(r'type="Texture2D" path="(.*)" id', text)
    if file is None:
        return lights, None, None
    turn = numbers(re.search(r"sky_rotation = Vector3(.*)", text)[1])[1]

    def direction(u, v):
        return spherical(2 * np.pi * u - turn, np.pi * v)

    return lights, file[1], direction


def spherical(phi, theta):
    """φ to the right of −Z, θ from +Y."""
    return np.stack([np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)], -1)


def unreal(path):
    """A script: left-handed with +Z up, y and z exchanged; the panorama's center is at −Y, its right half at +X."""
    found = {}
    for line in ast.parse(path.read_text()).body:
        if isinstance(line, ast.Assign) and line.targets[0].id.isupper():
            found[line.targets[0].id] = ast.literal_eval(line.value)
    assert found["LUMENS_PER_WATT"] == 683
    world = np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0]])
    lights = [(world @ toward, strength * np.array(color)) for _, toward, color, strength, _ in found["LIGHTS"]]
    if found["DOME"] is None:
        return lights, None, None

    def direction(u, v):
        a, theta = 2 * np.pi * (u - 0.5), np.pi * v
        # The cube's texel, turned back by the angle of the sky light.
        a = a - np.radians(found["DOME_ANGLE"])
        cube = np.stack([np.sin(a) * np.sin(theta), -np.cos(a) * np.sin(theta), np.cos(theta)], -1)
        return cube @ world.T

    return lights, found["DOME"], direction


def unity(path):
    """A script: left-handed, x is negated; the panorama's center is at +X, its right half at −Z."""
    text = path.read_text()
    number = r"[-+\de., f]+"
    pattern = rf'\("[^"]*", new Vector3\(({number})\), new Color\(({number})\), ({number})f, {number}\)'
    rows = [[numbers(part.replace("f", "")) for part in row] for row in re.findall(pattern, text)]
    mirror = np.array([-1, 1, 1])
    lights = [(mirror * toward, strength[0] * color) for toward, color, strength in rows]
    file = re.search(r'string Dome = "(.*)";', text)
    if file is None:
        return lights, None, None
    turn = np.radians(numbers(re.search(r"SkyRotation = (.*)f;", text)[1])[0])

    def direction(u, v):
        a, theta = 2 * np.pi * (0.5 - u) + turn, np.pi * v
        return mirror * np.stack([np.cos(a) * np.sin(theta), np.cos(theta), np.sin(a) * np.sin(theta)], -1)

    return lights, file[1], direction


def bevy(path):
    """A module: right-handed; cubes are made of the dome's picture with the probe's turn."""
    text = path.read_text()
    pattern = r'\("[^"]*", \[(.*?)\], \[(.*?)\], (.*?)\),'
    rows = [[numbers(part) for part in row] for row in re.findall(pattern, text)]
    lights = [(toward, strength[0] * color) for toward, color, strength in rows]
    command = re.search(r"domelight ibl (\S+) --env-rotate=(\S+)", text)
    if command is None:
        return lights, None, None
    turn = np.radians(float(command[2]))

    def direction(u, v):
        return spherical(2 * np.pi * (u - 0.5) - turn, np.pi * v)

    return lights, command[1], direction
