"""Prefiltered light as arrays and files."""

from __future__ import annotations

import pathlib

import domelight as dl
import numpy as np
import pytest


@pytest.fixture(scope="module")
def env() -> dl.Environment:
    texels = np.full((16, 32, 3), 0.5, np.float32)
    texels[5, 20] = (90.0, 80.0, 70.0)
    return dl.Environment(texels)


def test_levels_have_the_light_of_the_map(env):
    light = dl.prefilter(env, 16, threads=1)
    assert [level.shape for level in light.levels] == [(6, n, n, 3) for n in (16, 8, 4, 2, 1)]
    np.testing.assert_allclose(light.roughness, np.linspace(0, 1, 5), atol=1e-6)
    assert light.irradiance.shape == (6, 16, 16, 3)
    # The middle of +Y is lit by the upper half, as a white surface is.
    up = light.irradiance[2, 7:9, 7:9].mean(axis=(0, 1))
    assert np.all(up > 0.5)
    np.testing.assert_array_equal(light.axes, np.eye(3))
    mean = (env.solid_angles[:, None, None] * env.map).sum(axis=(0, 1)) / (4 * np.pi)
    np.testing.assert_allclose(light.harmonics[0] * 0.282095, mean, rtol=1e-4)


def test_a_white_map_stays_white():
    light = dl.prefilter(dl.Environment(np.ones((4, 8, 3))), 8, engine="filament")
    for cube in [*light.levels, light.irradiance]:
        np.testing.assert_allclose(cube, 1.0, atol=2e-3)
    assert light.brdf(8).shape == (8, 8, 2)


def test_octahedral_maps_are_squares(env, tmp_path: pathlib.Path):
    light = dl.prefilter(env, 16, layout="octahedral")
    assert light.layout == "octahedral"
    assert [level.shape for level in light.levels] == [(n, n, 3) for n in (16, 8, 4, 2, 1)]
    # Texels have equal areas.
    mean = (env.solid_angles[:, None, None] * env.map).sum(axis=(0, 1)) / (4 * np.pi)
    np.testing.assert_allclose(light.levels[0].mean(axis=(0, 1)), mean, rtol=1e-4)
    light.save(tmp_path / "light.dds")
    with pytest.raises(ValueError, match="reads cubes alone"):
        dl.prefilter(env, 16, engine="babylon", layout="octahedral").save(tmp_path / "light.env")
    with pytest.raises(ValueError, match="unknown layout"):
        dl.prefilter(env, 4, layout="disc")  # type: ignore[arg-type]


def test_files_are_those_of_the_arrays(env, tmp_path: pathlib.Path):
    light = dl.prefilter(env, 8)
    for name, texels, rtol in [("light.ktx2", "half", 1e-3), ("light.dds", "rgb9e5", 4e-3)]:
        path = tmp_path / name
        light.save(path, texels=texels)
        # A strip of faces as seen from inside.
        faces = dl.read(path).reshape(6, 8, 8, 3)
        expected = light.levels[0][:, :, ::-1].copy()
        expected[2:4] = light.levels[0][2:4, ::-1]
        np.testing.assert_allclose(faces, expected, rtol=rtol, atol=0.2 * rtol * expected.max())
    light.save(tmp_path / "diffuse.dds", "irradiance")
    light.save(tmp_path / "table.ktx2", "brdf")
    # The cube is read as a map again.
    again = dl.Environment.load(tmp_path / "light.ktx2")
    np.testing.assert_allclose(again.power, env.power, rtol=0.02)


def test_a_sun_is_removed_or_clamped():
    texels = np.full((32, 64, 3), 0.5, np.float32)
    texels[10, 40] = 1e5
    env = dl.Environment(texels)
    removed = dl.prefilter(env, 8, sun="remove")
    assert removed.sun is not None and len(removed.sun) == 1 and removed.sun.names == ["sun"]
    np.testing.assert_allclose(removed.levels[-1], 0.5, rtol=0.01)
    with pytest.warns(dl.DomelightWarning, match="clamping takes"):
        clamped = dl.prefilter(env, 8, sun="clamp:0.5")
    assert clamped.sun is None
    np.testing.assert_allclose(clamped.levels[-1], 0.5, rtol=0.01)
    with pytest.raises(ValueError, match="sun"):
        dl.prefilter(dl.Environment(np.full((4, 8, 3), 0.5)), 4, sun="remove")
    with pytest.raises(ValueError, match="clamp:X"):
        dl.prefilter(env, 4, sun="dim")


def test_files_of_one_engine(env, tmp_path: pathlib.Path):
    for name, engine, magic in [
        ("a.ktx", "filament", b"\xabKTX 11"),
        ("a.env", "babylon", b"\x86\x16\x87\x96"),
    ]:
        dl.prefilter(env, 16, engine=engine).save(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(magic)
        with pytest.raises(ValueError, match=f"engine='{engine}'"):
            dl.prefilter(env, 4).save(tmp_path / name)
    with pytest.raises(ValueError, match="not 12"):
        dl.prefilter(env, 12, engine="babylon").save(tmp_path / "b.env")


def test_bad_requests(env, tmp_path: pathlib.Path):
    with pytest.raises(ValueError, match="black"):
        dl.prefilter(dl.Environment(np.zeros((2, 4, 3))))
    with pytest.raises(ValueError, match="0 were requested"):
        dl.prefilter(env, 0)
    with pytest.raises(ValueError, match="unknown engine"):
        dl.prefilter(env, 4, engine="quake")  # type: ignore[arg-type]
    light = dl.prefilter(env, 4)
    for path, content, message in [("x.png", "radiance", ".ktx2"), ("x.dds", "sun", "content")]:
        with pytest.raises(ValueError, match=message):
            light.save(tmp_path / path, content)
    with pytest.warns(dl.DomelightWarning, match="clipped"):
        dl.prefilter(env.scaled(1e4), 4).save(tmp_path / "x.dds")
    with pytest.warns(dl.DomelightWarning, match="too dim for the format"):
        dl.prefilter(env.scaled(1e-12), 4).save(tmp_path / "x.dds")


def test_harmonics_do_not_ring():
    night = np.full((16, 32, 3), 1e-3, np.float32)
    night[5, 9] = 1e4
    sky = dl.Environment(night)
    assert 0.86 < dl.prefilter(sky, 4).harmonics_window < 1
    assert dl.prefilter(sky, 4, sh_window=False).harmonics_window == 1
