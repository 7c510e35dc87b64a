"""The pixel X-ray."""

import signal

import numpy as np
import pytest

import domelight as dl


def test_a_pixel_is_explained(sphere, env):
    def mine(points):
        return dl.strategies.Environment(env)(points)

    found = dl.inspect(
        sphere, env, pixel=(32, 32), size=(64, 64), strategies=["brdf", "product", mine], resolution=32
    )
    assert [s.name for s in found.strategies] == ["brdf", "product", "mine"]
    assert found.coverage == 1 and np.allclose(np.linalg.norm(found.normal), 1, atol=1e-5)
    assert np.allclose(found.frame @ found.frame.T, np.eye(3), atol=1e-5)
    assert found.maps["product"].shape == (32, 32, 3) and found.maps["visibility"].shape == (32, 32)
    for strategy in found.strategies:
        assert strategy.density.shape == (32, 32) and strategy.diagnosis in str(found)
        if strategy.shares:
            assert sum(strategy.shares.values()) == pytest.approx(1)
    # All estimate the same.
    means = [s.mean for s in found.strategies]
    assert means == pytest.approx([means[0]] * 3, rel=0.1)
    built_in = dl.inspect(
        sphere, env, pixel=(32, 32), size=(64, 64), strategies={"mine": "environment"}, resolution=32
    )
    assert built_in.strategies[0].variance == pytest.approx(found.strategies[2].variance, rel=1e-6)


def test_fixed_lights_are_biased(sphere, env):
    found = dl.inspect(sphere, env, pixel=(20, 20), size=(40, 40), strategies=["median-cut:4", "mis"], resolution=16)
    assert [s.unbiased for s in found.strategies] == [False, True]
    assert "that of mis" in found.strategies[0].diagnosis and "median-cut" not in found.advice


def test_a_notebook_shows_the_figure(sphere, env):
    found = dl.inspect(sphere, env, pixel=(20, 20), size=(40, 40), strategies=["mis"], resolution=16)
    pytest.importorskip("matplotlib")
    assert found._repr_png_().startswith(b"\x89PNG")


def test_threads_change_nothing(sphere, env):
    settings = dict(pixel=(20, 20), size=(40, 40), strategies=["mis"], resolution=16)
    found = [dl.inspect(sphere, env, threads=threads, **settings) for threads in (1, 3)]
    assert found[0].strategies[0].variance == found[1].strategies[0].variance
    with pytest.raises(ValueError, match="threads is 0"):
        dl.inspect(sphere, env, threads=0, **settings)


@pytest.mark.parametrize(
    "wrong, words",
    [
        (dict(pixel=(64, 3)), "64"),
        (dict(pixel=(-1, 3)), "pixel is"),
        (dict(strategies=[]), "no strategy"),
        (dict(strategies=["velvet"]), "velvet"),
        (dict(resolution=0), "resolution is 0"),
    ],
)
def test_wrong_wishes_are_named(sphere, env, wrong, words):
    with pytest.raises(ValueError, match=words):
        dl.inspect(sphere, env, **{"pixel": (1, 1), "size": (64, 64), **wrong})


def test_a_miss_has_no_hemisphere(sphere, env):
    found = dl.inspect(sphere, env, pixel=(0, 0), size=(64, 64), strategies=["mis"])
    assert found.coverage == 0 and found.maps == {} and found.position is None


def test_a_signal_ends_the_wait_for_an_inspection(env):
    class Stopped(Exception):
        pass

    def stop(*_):
        raise Stopped

    before = signal.signal(signal.SIGALRM, stop)
    scene = dl.Scene.builtin("statue")
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(Stopped):
            while True:
                dl.inspect(scene, env, pixel=(32, 32), size=(64, 64), strategies=["product:8", "mis"], resolution=64)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
