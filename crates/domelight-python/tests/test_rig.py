"""Light rigs."""

import json
import pickle

import numpy as np
import pytest

import domelight as dl


@pytest.mark.parametrize("method", ["variance-minimization", "median-cut"])
def test_lights_add_up_to_the_map(env, method):
    rig = dl.lights(env, 16, method=method)
    assert len(rig) == 16 and rig.residual is None
    assert rig == dl.lights(env, 16, method=method, threads=1)
    assert rig.directions.shape == rig.irradiance.shape == (16, 3)
    total = (env.map * env.solid_angles[:, None, None]).sum(axis=(0, 1))
    assert np.allclose(rig.irradiance.sum(axis=0), total, rtol=1e-4)
    assert np.allclose(np.linalg.norm(rig.directions, axis=1), 1, atol=1e-5)
    assert np.isclose(rig.share.sum(), 1, atol=1e-4)
    assert np.isclose(rig.solid_angle.sum(), 4 * np.pi, rtol=1e-4)
    assert rig.angular_radius.min() >= 0 and rig.names[0] == "light_1"
    assert rig.labels.shape == env.shape and set(np.unique(rig.labels)) == set(range(16))
    error = rig.shading_error(env)
    assert 0 < error["diffuse"] < error["glossy"] < 1


def test_a_sun_leaves_a_residual():
    env = dl.Environment.builtin("sky", rows=256)
    rig = dl.lights(env, None, sun=True)
    assert rig.names == ["sun"] and rig.residual is not None
    residual = rig.residual
    whole = (env.map * env.solid_angles[:, None, None]).sum(axis=(0, 1))
    left = (residual.map * env.solid_angles[:, None, None]).sum(axis=(0, 1))
    assert np.allclose(rig.irradiance.sum(axis=0) + left, whole, rtol=1e-4)
    assert (rig.labels == 0xFFFFFFFF).any()
    other = pickle.loads(pickle.dumps(rig))
    assert other == rig and np.array_equal(other.residual.map, residual.map)
    assert rig.shading_error(env)["diffuse"] < 0.01


FORMATS = {
    "json": "json", "csv": "csv", "gltf": "gltf", "glb": "glb", "usd": "usda", "blender": "py",
    "mitsuba": "xml", "pbrt": "pbrt", "three": "js", "radiance": "rad", "sibl": "ibl",
    "godot": "tscn", "unreal": "unreal.py", "unity": "cs", "bevy": "rs", "babylon": "babylon.js",
}  # fmt: skip


@pytest.mark.parametrize("format", FORMATS)
def test_every_format_is_the_programs(program, tmp_path, format):
    import subprocess

    name = f"rig.{FORMATS[format]}"
    dl.write(tmp_path / "probe.pfm", dl.Environment.builtin("cathedral", rows=64).map)
    for folder in ("program", "python"):
        (tmp_path / folder).mkdir()
    arguments = ["lights", "../probe.pfm", "--lamps", "3", "-o", name]
    subprocess.run([program, "--quiet", *arguments], check=True, cwd=tmp_path / "program")
    env = dl.Environment.load(tmp_path / "probe.pfm")
    env = dl.Environment(env.map, name="../probe.pfm")
    dl.lights(env, None, lamps=3).save(tmp_path / "python" / name)
    files = {file.name: file.read_bytes() for file in (tmp_path / "program").iterdir()}
    mine = {file.name: file.read_bytes() for file in (tmp_path / "python").iterdir()}
    # The program writes the map beside what was converted of it.
    assert set(mine) <= set(files)
    for file, content in mine.items():
        assert content == files[file], file


def test_formats_by_name(env, tmp_path):
    rig = dl.lights(env, 4)
    rig.save(tmp_path / "rig.txt", format="json")
    assert len(json.loads((tmp_path / "rig.txt").read_text())["lights"]) == 4
    with pytest.raises(ValueError, match="tiff"):
        rig.save(tmp_path / "rig.json", format="tiff")
    with pytest.raises(ValueError, match="must end in"):
        rig.save(tmp_path / "rig.tiff")
    with pytest.raises(OSError):
        rig.save(tmp_path / "nowhere" / "rig.json")


def test_rigs_are_pickled(env):
    for rig in (dl.lights(env, 8), dl.lights(env, 8, method="median-cut")):
        other = pickle.loads(pickle.dumps(rig))
        assert other == rig and other.names == rig.names and other != dl.lights(env, 7)
        assert hash(other) == hash(rig)


@pytest.mark.parametrize(
    "wrong, words",
    [
        (dict(n=0), "n is 0"),
        (dict(method="velvet"), "velvet"),
        (dict(threads=0), "threads is 0"),
        (dict(min_share=2), "min_share is 2"),
        (dict(n=None), "0 were requested"),
    ],
)
def test_wrong_wishes_are_named(env, wrong, words):
    with pytest.raises(ValueError, match=words):
        dl.lights(env, **wrong)


def test_black_maps_have_no_lights():
    with pytest.raises(ValueError, match="black"):
        dl.lights(dl.Environment(np.zeros((4, 8, 3))), 4)


def test_a_notebook_shows_balls_in_the_light_of_the_rig():
    env = dl.Environment.builtin("sky", rows=32)
    for rig, balls in [(dl.lights(env, 4), 1), (dl.lights(env, None, sun=True), 3)]:
        png = rig._repr_png_()
        assert png.startswith(b"\x89PNG")
        assert tuple(int.from_bytes(png[i : i + 4], "big") for i in (16, 20)) == (192 * balls, 192)
