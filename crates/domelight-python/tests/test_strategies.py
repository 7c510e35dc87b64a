"""Strategies written in Python."""

import time

import numpy as np
import pytest

import domelight as dl

SIZE = dict(spp=4, size=(40, 32))


@pytest.fixture(scope="module")
def statue():
    return dl.Scene.builtin("statue")


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("tile_size", [5, 64])
def test_environment_is_the_built_in_one_to_the_bit(statue, env, n, tile_size):
    mine = dl.render(statue, env, dl.strategies.Environment(env, n), tile_size=tile_size, **SIZE)
    theirs = dl.render(statue, env, f"environment:{n}", **SIZE)
    for name in mine:
        assert np.array_equal(mine[name], theirs[name]), name
    assert mine.shadow_rays == theirs.shadow_rays and mine.strategy == "python"


def test_brdf_is_the_built_in_one_to_the_bit(statue, env):
    mine = dl.render(statue, env, dl.strategies.Brdf(env, 2), **SIZE)
    assert mine == dl.render(statue, env, "brdf:2", **SIZE)


@pytest.mark.parametrize("material", ["diffuse:0.7", "ggx:0.4"])
def test_all_estimate_the_same(env, material):
    """The mean of an unoccluded picture over seeds, against the built-in strategy's."""
    scene = dl.Scene.builtin("sphere", material=material)
    power = np.ones(env.shape)
    power[: env.shape[0] // 2] = 3
    strategies = [
        dl.strategies.Cosine(env, 4),
        dl.strategies.Mis(env, 2, 2),
        dl.strategies.Mis(env, 2, 2, dl.Density(env, np.eye(*env.shape) + 1e-3)),
        dl.strategies.Environment(env, 4, dl.Density(env, power)),
    ]
    settings = dict(spp=16, size=(8, 8), sampler="independent", hide_env=True)

    def means(strategy):
        films = (dl.render(scene, env, strategy, seed=seed, **settings) for seed in range(40))
        return np.array([film.color.mean(axis=(0, 1)) for film in films])

    expected = means("mis:4:4")
    error = expected.std(axis=0, ddof=1) / np.sqrt(len(expected))
    for strategy in strategies:
        dl.testing.z_test(
            means(strategy), expected.mean(axis=0), standard_error=error, batches=40, tests=8,
            name=f"{type(strategy).__name__}, {material}",
        )


def test_points_know_their_surface(sphere, env):
    seen = []

    def look(points):
        seen.append(points)
        return np.arange(len(points)), points.normal, np.full(len(points), 0.5)

    film = dl.render(sphere, env, look, hide_env=True, **SIZE)
    assert film["unoccluded"].max() == pytest.approx(0.5, abs=1e-6)
    for points in seen:
        n = len(points)
        for values in (points.position, points.normal, points.geometric_normal, points.wo, points.albedo):
            assert values.shape == (n, 3) and values.dtype == np.float32
        assert np.allclose(np.linalg.norm(points.position, axis=1), 1, atol=0.02)
        assert np.allclose(points.position, points.normal, atol=0.02)
        assert (np.einsum("ij,ij->i", points.normal, points.wo) > 0).all()
        u = points.random(2, "brdf")
        assert u.shape == (n, 2, 4) and (u >= 0).all() and (u < 1).all()
        wi, value, pdf = points.sample(u)
        again, density = points.eval_pdf(wi)
        drawn = pdf > 0
        assert np.allclose(again[drawn], value[drawn], rtol=1e-4)
        assert np.allclose(density[drawn], pdf[drawn], rtol=1e-4)
        # The same by index.
        index = np.arange(n)[::-1]
        assert np.array_equal(points.eval(wi[::-1, 0], index)[::-1], points.eval(wi[:, 0]))
        with pytest.raises(ValueError, match="purpose"):
            points.random(1, "velvet")
        with pytest.raises(ValueError, match="index"):
            points.eval(points.normal, np.full(n, n))
        with pytest.raises(ValueError, match="rows"):
            points.eval(points.normal[:-1])


def test_rays_come_in_any_order(sphere, env):
    own = dl.strategies.Environment(env, 2)

    def shuffled(points):
        index, wi, weight = own(points)
        order = np.random.default_rng(1).permutation(len(index))
        return index[order], wi[order], weight[order]

    shuffled.n_rays = 2
    mine = dl.render(sphere, env, shuffled, **SIZE)
    assert np.allclose(mine.color, dl.render(sphere, env, own, **SIZE).color, rtol=1e-5, atol=1e-6)


def test_nothing_below_the_surface_counts(sphere, env):
    def below(points):
        return np.arange(len(points)), -points.normal, np.ones(len(points))

    film = dl.render(sphere, env, below, hide_env=True, **SIZE)
    assert not film.color.any() and film.shadow_rays == 0


@pytest.mark.parametrize(
    "result, words",
    [
        (lambda p: None, "must return"),
        (lambda p: (1, 2), "must return"),
        (lambda p: ([0], [[0, 1, 0], [1, 0, 0]], [1, 1]), "wi has shape"),
        (lambda p: ([0], [[0, 1, 0]], [1, 1]), "weight has shape"),
        (lambda p: ([len(p)], [[0, 1, 0]], [1]), "index holds"),
        (lambda p: ([-1], [[0, 1, 0]], [1]), "index holds -1"),
        (lambda p: ([0.5], [[0, 1, 0]], [1]), "index has dtype"),
        (lambda p: ([0], [[0, 3, 0]], [1]), "unit vector"),
        (lambda p: ([0], [[np.nan, 0, 0]], [1]), "unit vector"),
    ],
)
def test_wrong_results_are_named(sphere, env, result, words):
    with pytest.raises(ValueError, match=words):
        dl.render(sphere, env, result, **SIZE)


def test_what_is_raised_comes_back(sphere, env):
    def broken(points):
        raise LookupError("my own")

    with pytest.raises(LookupError, match="my own"):
        dl.render(sphere, env, broken, **SIZE)
    steps = dl.progressive(sphere, env, broken, **SIZE)
    with pytest.raises(LookupError, match="my own"):
        next(steps)
    assert list(steps) == []
    broken.n_rays = 0
    with pytest.raises(ValueError, match="n_rays is 0"):
        dl.render(sphere, env, broken, **SIZE)


def test_more_rays_than_announced_are_refused(sphere, env):
    def two(points):
        index = np.repeat(np.arange(len(points)), 2)
        return index, points.normal[index], np.full(len(index), 0.5)

    with pytest.raises(ValueError, match="beyond its n_rays, 1"):
        dl.render(sphere, env, two, **SIZE)
    two.n_rays = 2
    assert dl.render(sphere, env, two, **SIZE).color.any()


def test_not_a_number_is_counted(sphere, env):
    def wrong(points):
        return np.arange(len(points)), points.normal, np.full(len(points), np.nan)

    with pytest.warns(dl.DomelightWarning, match="NaN"):
        film = dl.render(sphere, env, wrong, **SIZE)
    assert film.non_finite > 0 and np.isfinite(film.color).all()


@pytest.mark.timing
def test_a_strategy_in_python_is_fast_enough(sphere, env):
    """At least a quarter of the built-in rate of shadow rays, at tiles of 64 x 64."""
    settings = dict(spp=16, size=(256, 256), hide_env=True)

    def rate(strategy, **more):
        rates = []
        for _ in range(3):
            start = time.perf_counter()
            film = dl.render(sphere, env, strategy, **settings, **more)
            rates.append(film.shadow_rays / (time.perf_counter() - start))
        return max(rates)

    built_in = rate("environment")
    python = rate(dl.strategies.Environment(env), tile_size=64)
    print(f"\nshadow rays per second: built in {built_in:.3g}, Python {python:.3g}, {python / built_in:.0%}")
    assert python > 0.25 * built_in


def test_the_decorator_sets_the_number_of_rays(sphere, env):
    @dl.strategy(n_rays=2)
    def two(points):
        return dl.strategies.Environment(env, 2)(points)

    assert two.n_rays == 2
    film = dl.render(sphere, env, two, spp=1, size=(8, 8))
    assert film == dl.render(sphere, env, "environment:2", spp=1, size=(8, 8))
