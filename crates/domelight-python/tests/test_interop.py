"""What goes to Mitsuba and comes from it, with a module that stands in for it; `by_hand/mitsuba_check.py` asks the real one."""

import sys
import types

import numpy as np
import pytest

import domelight as dl


class Bitmap:
    """A picture of Mitsuba's."""

    class PixelFormat:
        RGB = "rgb"

    def __init__(self, array):
        self.array = np.array(array, dtype=np.float32)

    def convert(self, pixel_format, component_format, srgb_gamma):
        assert (pixel_format, component_format, srgb_gamma) == ("rgb", "float32", False)
        return self

    def __array__(self, dtype=None, copy=None):
        return self.array


class Transform:
    def __init__(self, matrix):
        self.matrix = np.array(matrix)


def emitter(description, margin=2):
    """The parameters of an emitter, as `mitsuba.traverse` has them."""
    data = description["bitmap"].array
    first = data[:, -1:] if margin == 2 else data[:, :0]
    return {
        "data": np.concatenate([first, data, data[:, :1]], axis=1),
        "to_world": description["to_world"],
        "scale": description.get("scale", 1.0),
    }


@pytest.fixture(autouse=True)
def mitsuba(monkeypatch):
    module = types.ModuleType("mitsuba")
    module.Bitmap = Bitmap
    module.ScalarTransform4f = Transform
    module.Struct = types.SimpleNamespace(Type=types.SimpleNamespace(Float32="float32"))
    module.traverse = lambda parameters: parameters
    monkeypatch.setitem(sys.modules, "mitsuba", module)
    return module


@pytest.fixture
def map(rng):
    return rng.random((8, 16, 3), dtype=np.float32)


def directions(rng):
    d = rng.normal(size=(500, 3))
    return (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("margin", [1, 2])
def test_environments_return_from_mitsuba(map, rng, up, margin):
    env = dl.Environment(map, rotation=35.0, scale=2.0, up=up)
    back = dl.Environment.from_mitsuba(emitter(env.to_mitsuba(), margin))
    assert back.up == up and back.shape == env.shape
    assert back.rotation == pytest.approx(35.0, abs=1e-3)
    assert np.array_equal(back.map, env.map)


def test_mitsuba_looks_along_the_same_directions(map, rng):
    """Mitsuba finds the texel of a local direction (x, y, z) at u = atan2(x, -z)/2π, v = acos(y)/π."""
    env = dl.Environment(map, rotation=35.0)
    description = env.to_mitsuba()
    wi = directions(rng)
    x, y, z = (wi @ description["to_world"].matrix[:3, :3]).T
    column = (np.arctan2(x, -z) / (2 * np.pi) % 1 * 16).astype(int) % 16
    row = np.minimum((np.arccos(np.clip(y, -1, 1)) / np.pi * 8).astype(int), 7)
    same = np.all(description["bitmap"].array[row, column] == env.radiance(wi), axis=1)
    # But for directions between two texels.
    assert same.mean() > 0.99


def test_pictures_and_constant_light_come_from_mitsuba(map):
    env = dl.Environment.from_mitsuba(Bitmap(map))
    assert np.array_equal(env.map, map) and env.rotation == 180.0
    white = dl.Environment.from_mitsuba({"radiance.value": np.float32([1, 2, 3])})
    assert np.array_equal(white.radiance([0, 1, 0]), [1, 2, 3])


def test_what_cannot_come_from_mitsuba_is_named(map):
    tilted = {"data": np.ones((4, 10, 3)), "to_world": Transform(np.diag([1.0, 2.0, 1.0, 1.0]))}
    with pytest.raises(ValueError, match="without scale"):
        dl.Environment.from_mitsuba(tilted)
    with pytest.raises(ValueError, match=r"the shape \(4, 10, 4\)"):
        dl.Environment.from_mitsuba({"data": np.ones((4, 10, 4)), "to_world": Transform(np.eye(4))})
    with pytest.raises(ValueError, match="it must be an 'envmap'"):
        dl.Environment.from_mitsuba({"intensity": 1.0})


def test_mitsuba_is_asked_for_only_where_it_is_needed(map, monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(ImportError):
        dl.Environment(map).to_mitsuba()
