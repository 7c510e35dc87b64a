"""Environments, densities and their arrays."""

import copy
import pickle
import signal
import warnings

import numpy as np
import pytest

import domelight as dl


def test_samples_look_up_as_they_were_drawn(env, rng):
    u = rng.random((1000, 2), np.float32)
    wi, radiance, pdf = env.sample(u)
    assert (wi.shape, radiance.shape, pdf.shape) == ((1000, 3), (1000, 3), (1000,))
    assert np.array_equal(radiance, env.radiance(wi)) and np.array_equal(pdf, env.pdf(wi))
    assert np.allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-6)


def test_leading_axes_are_kept(env, rng):
    u = rng.random((4, 5, 2), np.float32)
    wi, radiance, pdf = env.sample(u)
    assert (wi.shape, radiance.shape, pdf.shape) == ((4, 5, 3), (4, 5, 3), (4, 5))
    single = env.sample(u[1, 2])
    assert np.array_equal(single[0], wi[1, 2]) and single[2].shape == ()
    assert env.sample(np.empty((0, 2)))[0].shape == (0, 3)


def test_the_map_goes_in_and_out(rng):
    values = rng.random((8, 16, 3), np.float32)
    env = dl.Environment(values, rotation=30, up="z", name="mine")
    assert np.array_equal(env.map, values) and env.shape == (8, 16)
    assert (env.rotation, env.up, env.name) == (30, "z", "mine")
    assert np.isclose(env.solid_angles.sum() * 16, 4 * np.pi)
    luminance = env.map @ np.array([0.2126, 0.7152, 0.0722])
    assert np.isclose(env.power, (luminance * env.solid_angles[:, None]).sum(), rtol=1e-5)
    uv = rng.random((50, 2), np.float32)
    assert np.allclose(env.uv(env.directions(uv)), uv, atol=1e-5)


def test_turned_and_scaled(env):
    assert env.rotated(30).rotated(-10).rotation == 20
    assert np.array_equal(env.scaled(2).map, 2 * env.map)
    assert np.array_equal(env.rotated(90).radiance([-1, 0, 0]), env.radiance([0, 0, -1]))
    with pytest.raises(ValueError, match="-1"):
        env.scaled(-1)
    with pytest.raises(ValueError, match="NaN"):
        env.rotated(float("nan"))


@pytest.mark.parametrize("factor", [1e-42, 3e38])
def test_extreme_maps_keep_their_radiance(factor, rng):
    values = (rng.random((4, 8, 3)) * factor).astype(np.float32)
    env = dl.Environment(values)
    assert np.allclose(env.map, values, rtol=1e-6)
    wi, radiance, pdf = env.sample(rng.random((100, 2)))
    assert np.array_equal(radiance, env.radiance(wi)) and np.all(pdf > 0)
    assert np.array_equal(pickle.loads(pickle.dumps(env)).map, env.map)
    # The unit is beyond single precision.
    for scaled in (env.scaled(factor), env.scaled(factor).scaled(factor)):
        other = pickle.loads(pickle.dumps(scaled))
        assert other.power == scaled.power > 0 and np.array_equal(other.map, scaled.map)


def test_environments_are_pickled_and_copied(env):
    for other in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        assert np.array_equal(other.map, env.map)
        assert (other.rotation, other.up, other.name) == (env.rotation, env.up, env.name)


def test_wrong_maps_are_named(tmp_path):
    bad = np.ones((4, 8, 3), np.float32)
    bad[1, 2, 0] = np.nan
    with pytest.raises(ValueError, match=r"texel \(2, 1\)"):
        dl.Environment(bad)
    for shape in [(4, 8), (4, 8, 4), (3,), (2, 2, 2, 3)]:
        with pytest.raises(ValueError, match="map has shape"):
            dl.Environment(np.ones(shape))
    with pytest.raises(ValueError, match="empty"):
        dl.Environment(np.ones((0, 8, 3)))
    with pytest.raises(ValueError, match="complex"):
        dl.Environment(np.ones((4, 8, 3), complex))
    with pytest.raises(ValueError, match='up is "x"'):
        dl.Environment(np.ones((4, 8, 3)), up="x")
    with pytest.raises(ValueError, match="velvet"):
        dl.Environment.builtin("velvet")
    with pytest.raises(ValueError, match="rows"):
        dl.Environment.builtin("sky", rows=0)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        dl.Environment.load(tmp_path / "nowhere.hdr")
    (tmp_path / "text.hdr").write_text("no picture")
    with pytest.raises(ValueError, match="text.hdr"):
        dl.Environment.load(tmp_path / "text.hdr")


def test_uniform_numbers_are_checked(env):
    for value in (1.0, -0.1, np.nan):
        with pytest.raises(ValueError, match=r"u\[1, 0\]"):
            env.sample([[0.5, 0.5], [value, 0.5]])
    with pytest.raises(ValueError, match=r"u has shape \(3,\)"):
        env.sample([0.1, 0.2, 0.3])
    # In single precision these would be 1.
    almost_one, largest = 1 - 2.0**-30, np.float32(1) - np.float32(2) ** -24
    for drawn, expected in zip(env.sample([[almost_one, 0.5]]), env.sample([[largest, 0.5]])):
        assert np.array_equal(drawn, expected)
    with pytest.raises(ValueError, match=r"u\[1, 0\]"):
        env.sample([[almost_one, 0.5], [1.0, 0.5]])


def test_repairs_are_warnings(tmp_path):
    values = np.ones((4, 8, 3), np.float32)
    values[0, 0, 0] = -1
    dl.write(tmp_path / "negative.pfm", values)
    with pytest.warns(dl.DomelightWarning, match="repaired 1 negative"):
        dl.Environment.load(tmp_path / "negative.pfm")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(dl.DomelightWarning):
            dl.Environment.load(tmp_path / "negative.pfm")
    with pytest.raises(ValueError, match="negative"):
        dl.Environment.load(tmp_path / "negative.pfm", strict=True)


def test_densities_of_ones_own(env, rng):
    weights = rng.random(env.shape)
    density = dl.Density(env, weights)
    wi, radiance, pdf = density.sample(rng.random((1000, 2)))
    assert np.array_equal(pdf, density.pdf(wi)) and np.array_equal(radiance, env.radiance(wi))
    dl.testing.chi2(lambda u: density.sample(u[:, :2])[0], density.pdf, cells=(17, 33))
    # Luminance is the environment's own density.
    own = dl.Density(env, env.map @ np.array([0.2126, 0.7152, 0.0722], np.float32))
    assert np.allclose(own.pdf(wi), env.pdf(wi), rtol=1e-5)
    with pytest.raises(ValueError, match=r"weights has shape \(2, 2\)"):
        dl.Density(env, np.ones((2, 2)))
    weights[3, 4] = -1
    with pytest.raises(ValueError, match=r"texel \(4, 3\)"):
        dl.Density(env, weights)
    with pytest.raises(ValueError, match="all weights are 0"):
        dl.Density(env, np.zeros(env.shape))


def test_densities_are_pickled_and_compared(env):
    weights = np.linspace(0, 1, env.map[..., 0].size).reshape(env.shape)
    density = dl.Density(env, weights)
    wi = np.array([[0, 1, 0], [0.6, 0, 0.8]])
    for other in (pickle.loads(pickle.dumps(density)), copy.deepcopy(density), dl.Density(env, weights)):
        assert other == density and hash(other) == hash(density)
        assert np.array_equal(other.pdf(wi), density.pdf(wi))
    assert density != dl.Density(env, weights + 1) and density != dl.Density(env.scaled(2), weights)


def test_a_notebook_shows_the_map():
    for rows, size in [(4, (8, 4)), (600, (400, 200))]:
        png = dl.Environment.builtin("studio", rows=rows)._repr_png_()
        assert png.startswith(b"\x89PNG")
        assert tuple(int.from_bytes(png[i : i + 4], "big") for i in (16, 20)) == size


def test_a_signal_ends_the_wait_for_a_map():
    """The handler's exception comes at once, not when the map is complete."""
    class Stopped(Exception):
        pass

    def stop(*_):
        raise Stopped

    before = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        with pytest.raises(Stopped):
            while True:
                dl.Environment.builtin("cathedral", rows=1024)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_spherical_gaussians_have_the_light_of_the_map():
    texels = np.full((16, 32, 3), 0.5, np.float32)
    texels[5, 20] = (900.0, 800.0, 700.0)
    env = dl.Environment(texels)
    lobes = env.spherical_gaussians(6, threads=1)
    assert lobes.shape == (6, 7) and lobes.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(lobes[:, :3], axis=1), 1.0, rtol=1e-6)
    assert lobes.min(axis=0)[3:].min() >= 0.0
    sharpness, amplitude = lobes[:, 3:4].astype(float), lobes[:, 4:]
    flux = (2 * np.pi * -np.expm1(-2 * sharpness) / sharpness * amplitude).sum(axis=0)
    expected = (env.solid_angles[:, None, None] * texels).sum(axis=(0, 1))
    np.testing.assert_allclose(flux, expected, rtol=1e-3)
    # The sun comes first.
    np.testing.assert_allclose(lobes[0, :3], env.directions(np.array([20.5 / 32, 5.5 / 16])), atol=1e-2)
    with pytest.raises(ValueError, match="black"):
        dl.Environment(np.zeros((2, 4, 3))).spherical_gaussians()
    for n, message in [(0, "0 were requested"), (1025, "at most 1024")]:
        with pytest.raises(ValueError, match=message):
            env.spherical_gaussians(n)


def test_shader_tables_are_those_of_the_program(env):
    tables = env.shader_tables(texels=64)
    assert tables.shape[2] == 4 and tables.dtype == np.float32
    width, height, levels, first = tables.reshape(-1, 4)[0]
    assert width * height <= 64 and levels == np.ceil(np.log2(max(width, height)))
    texels = tables.reshape(-1, 4)[int(first) :][: int(width * height)]
    sines = np.diff(-np.cos(np.linspace(0, np.pi, int(height) + 1)))
    sr = np.repeat(sines * 2 * np.pi / width, int(width))
    assert np.isclose((texels[:, 3] * sr).sum(), 1, rtol=1e-5)
    luminance = texels[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert np.isclose((luminance * sr).sum(), env.power, rtol=1e-4)
    assert "domelight_sample" in dl.shader_code("wgsl")
    with pytest.raises(ValueError, match="basic"):
        dl.shader_code("basic")
    with pytest.raises(ValueError, match="black"):
        dl.Environment(np.zeros((2, 4, 3))).shader_tables()
