"""Metrics and proofs."""

import numpy as np
import pytest

import domelight as dl


@pytest.fixture
def pictures(rng):
    reference = rng.random((40, 50, 3), np.float32)
    return reference + rng.normal(0, 0.05, reference.shape).astype(np.float32), reference


def test_formulas(pictures):
    test, reference = (p.astype(np.float64) for p in pictures)
    squares = (test - reference) ** 2
    assert dl.metrics.mse(*pictures) == pytest.approx(squares.mean())
    assert dl.metrics.rel_mse(*pictures) == pytest.approx((squares / (reference**2 + 0.01)).mean())
    assert dl.metrics.rel_mse_trimmed(*pictures) < dl.metrics.rel_mse(*pictures)
    psnr = 10 * np.log10(reference.max() ** 2 / squares.mean())
    assert dl.metrics.psnr(*pictures) == pytest.approx(psnr)
    black = np.zeros((2, 2, 3))
    assert dl.metrics.psnr(black, black) == np.inf
    absolute = dl.metrics.absolute_error_map(*pictures)
    assert np.allclose(absolute, np.sqrt(squares.mean(axis=-1)), rtol=1e-4)
    relative = np.sqrt((squares / (reference**2 + 0.01)).mean(axis=-1))
    assert np.allclose(dl.metrics.relative_error_map(*pictures), relative, rtol=1e-4)
    found = dl.metrics.compare(*pictures)
    assert found["n_pixels"] == 2000 and found["n_non_finite"] == 0
    assert np.allclose(found["mean_ratio"], test.mean((0, 1)) / reference.mean((0, 1)), rtol=1e-6)


def test_masks(pictures):
    mask = np.zeros((40, 50), bool)
    mask[3:7] = True
    expected = dl.metrics.mse(pictures[0][3:7], pictures[1][3:7])
    assert dl.metrics.mse(*pictures, mask) == pytest.approx(expected)
    with pytest.raises(ValueError, match="mask has shape"):
        dl.metrics.mse(*pictures, mask[1:])


def test_flip_of_equal_and_other_pictures(pictures):
    test, reference = pictures
    assert dl.metrics.flip(reference, reference) == 0
    assert dl.metrics.hdr_flip(reference, reference) == 0
    for flip in (dl.metrics.flip_map, dl.metrics.hdr_flip_map):
        values = flip(test, reference)
        assert values.shape == (40, 50) and 0 < values.mean() < 1
    assert dl.metrics.flip(test, reference, 20) != dl.metrics.flip(test, reference)
    for resolution in (0, 1, np.nan, 20_000):
        for flip in (dl.metrics.flip, dl.metrics.hdr_flip):
            with pytest.raises(ValueError, match="pixels_per_degree"):
                flip(test, reference, resolution)
    assert dl.metrics.flip(test, reference, 2) > 0
    for odd, usual in [(np.nan, 0), (np.inf, 1e30)]:
        odd, usual = (np.full_like(reference, value) for value in (odd, usual))
        for flip in (dl.metrics.flip, dl.metrics.hdr_flip):
            assert flip(odd, reference) == flip(usual, reference)


def test_other_sizes_are_named(pictures):
    for metric in (dl.metrics.mse, dl.metrics.flip, dl.metrics.hdr_flip, dl.metrics.relative_error_map):
        with pytest.raises(ValueError, match="50x40 against 50x39"):
            metric(pictures[0], pictures[1][1:])


def test_pictures_go_through_files(pictures, tmp_path):
    for extension in ("exr", "pfm"):
        dl.write(tmp_path / f"a.{extension}", pictures[0])
        assert np.array_equal(dl.read(tmp_path / f"a.{extension}"), pictures[0])
    dl.write(tmp_path / "a.hdr", pictures[1])
    assert np.allclose(dl.read(tmp_path / "a.hdr"), pictures[1], atol=0.01)
    shown = dl.tone_map(pictures[1], exposure=0, curve="srgb")
    assert shown.min() >= 0 and shown.max() <= 1
    dl.write(tmp_path / "a.png", pictures[1], exposure=0, curve="srgb")
    assert np.allclose(dl.read(tmp_path / "a.png"), pictures[1].clip(0, 1), atol=0.01)
    with pytest.raises(ValueError, match="must end in"):
        dl.write(tmp_path / "a.tiff", pictures[0])
    with pytest.raises(ValueError, match="picture has shape"):
        dl.write(tmp_path / "b.exr", np.zeros((0, 4, 3)))
    assert not (tmp_path / "b.exr").exists()


def uniform(u):
    z, phi = 1 - 2 * u[:, 0], 2 * np.pi * u[:, 1]
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def test_chi2_tells_right_from_wrong():
    right = lambda w: np.full(len(w), 1 / (4 * np.pi))
    report = dl.testing.chi2(uniform, right)
    assert report["p_value"] > 0.01 and report["mass"] == pytest.approx(1)
    with pytest.raises(AssertionError, match="slanted"):
        dl.testing.chi2(uniform, lambda w: (1 + 0.2 * w[:, 2]) / (4 * np.pi), name="slanted")
    with pytest.raises(AssertionError, match="> 1"):
        dl.testing.chi2(uniform, lambda w: np.full(len(w), 1.0))
    half = lambda u: np.where(u[:, 2:] < 0.5, uniform(u), 0)
    report = dl.testing.chi2(half, lambda w: np.full(len(w), 1 / (8 * np.pi)))
    assert 49_000 < report["lost"] < 51_000
    with pytest.raises(LookupError):
        dl.testing.chi2(uniform, lambda w: {}["nothing"])
    with pytest.raises(ValueError, match="the result of sample has shape"):
        dl.testing.chi2(lambda u: u[1:], right)
    for wrong in (lambda u: 2 * uniform(u), lambda u: np.full((len(u), 3), np.nan)):
        with pytest.raises(ValueError, match="the row 0 .* unit vector"):
            dl.testing.chi2(wrong, right)
    with pytest.raises(AssertionError, match="refine the cells"):
        dl.testing.chi2(uniform, lambda w: 0.9 * right(w))
    for wrong, words in [
        (dict(samples=1), "samples is 1"),
        (dict(cells=(1, 2)), "cells"),
        (dict(axis=(0, 0, 0)), "axis"),
        (dict(tests=0), "tests is 0"),
        (dict(significance=1.0), "significance"),
    ]:
        with pytest.raises(ValueError, match=words):
            dl.testing.chi2(uniform, right, **wrong)


@pytest.mark.parametrize("probe, rows", [("sky", 33), ("sky", 128), ("cathedral", 16), ("cathedral", 64)])
def test_chi2_passes_the_samplers_of_maps(probe, rows):
    """Their densities are constant over each texel, which the default cells cut anywhere."""
    env = dl.Environment.builtin(probe, rows=rows)
    for axis in [(0, 0, 1), (0, 1, 0)]:
        report = dl.testing.chi2(lambda u: env.sample(u[:, :2])[0], env.pdf, axis=axis, tests=8)
        assert report["mass"] == pytest.approx(1, abs=1e-4)


def test_z_test_tells_right_from_wrong():
    squares = lambda rng, n: rng.random(n) ** 2
    assert dl.testing.z_test(squares, 1 / 3) > 0.01
    with pytest.raises(AssertionError, match="squares"):
        dl.testing.z_test(squares, 0.34, name="squares")
    both = lambda rng, n: rng.random((n, 2)) ** [1, 2]
    assert dl.testing.z_test(both, [1 / 2, 1 / 3]) > 0.005
    assert dl.testing.z_test(squares, 0.34, standard_error=0.01) > 0.01
    assert dl.testing.z_test(np.full(100, 2.0), 2.0, batches=50) == 1
    for wrong, words in [
        (dict(batches=3), "at least 30"),
        (dict(samples=40), "as many as batches"),
        (dict(reference=[1, 2]), "reference has shape"),
        (dict(standard_error=np.nan), "standard_error is NaN"),
        (dict(standard_error=-0.1), "standard_error is -0.1"),
        (dict(rounding=np.nan), "rounding is NaN"),
    ]:
        with pytest.raises(ValueError, match=words):
            dl.testing.z_test(squares, **{"reference": 1 / 3, **wrong})
    # The last estimates count, too.
    with pytest.raises(AssertionError):
        dl.testing.z_test(np.append(np.zeros(300), np.full(99, 1e3)), 0, batches=100)
    with pytest.raises(ValueError, match="estimates have shape"):
        dl.testing.z_test(np.zeros((50, 2, 2)), 0)
