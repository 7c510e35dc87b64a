"""Readers written from the documentation of formats whose programs cannot be had here.

pbrt-v4 (its file format guide and `EqualAreaSphereToSquare`, after Clarberg 2008) and sIBL (HDR
Labs' format specification). They prove less than a program would.
"""

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
