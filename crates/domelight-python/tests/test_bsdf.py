"""BSDFs, the library's and one's own."""

import itertools
import pickle
import threading

import numpy as np
import pytest

import domelight as dl


def directions(rng, n):
    w = rng.normal(size=(n, 3)).astype(np.float32)
    w[:, 2] = np.abs(w[:, 2]) + 0.05
    return w / np.linalg.norm(w, axis=1, keepdims=True)


def diffuse(albedo=0.6):
    return dl.Bsdf.custom(
        lambda wo, wi: np.float32(albedo / np.pi) * wi[:, 2],
        albedo=albedo,
        max_eval=albedo / np.pi,
    )


def test_weights_are_value_over_density(rng):
    bsdf = dl.Bsdf.parse("mix")
    wo, u = directions(rng, 500), rng.random((500, 3), np.float32)
    wi, weight, pdf = bsdf.sample(wo, u)
    value, density = bsdf.eval_pdf(wo, wi)
    drawn = pdf > 0
    assert drawn.mean() > 0.8
    assert np.array_equal(density[drawn], pdf[drawn])
    assert np.allclose(weight[drawn], value[drawn] / pdf[drawn, None], rtol=1e-6)
    assert not wi[~drawn].any() and not weight[~drawn].any()


def test_a_single_view_serves_all(rng):
    bsdf = dl.Bsdf.parse("ggx:0.3")
    wi = directions(rng, 20)
    value = bsdf.eval([0, 0.6, 0.8], wi)
    assert value.shape == (20, 3)
    assert np.array_equal(value[3], bsdf.eval([0, 0.6, 0.8], wi[3]))
    with pytest.raises(ValueError, match=r"wo has shape \(5, 3\) and wi has shape \(20, 3\)"):
        bsdf.eval(directions(rng, 5), wi)


def test_two_numbers_do_for_a_single_lobe(rng):
    wo, u = directions(rng, 10), rng.random((10, 3), np.float32)
    u[:, 2] = 0
    lambert = dl.Bsdf.parse("diffuse:0.5")
    assert np.array_equal(lambert.sample(wo, u)[0], lambert.sample(wo, u[:, :2])[0])
    with pytest.raises(ValueError, match="third number"):
        dl.Bsdf.parse("mix").sample(wo, u[:, :2])


@pytest.mark.parametrize("text", ["diffuse:0.8", "ggx:0.3", "phong:20:0.5:0.3", "ward:0.3:0.5"])
def test_samplers_follow_their_densities(text):
    bsdf = dl.Bsdf.parse(text)
    wo = np.array([0.6, 0, 0.8], np.float32)
    report = dl.testing.chi2(
        lambda u: bsdf.sample(wo, u)[0], lambda wi: bsdf.pdf(wo, wi), tests=4, name=text
    )
    assert report["mass"] < 1.001


def test_wrong_texts_say_what_may_stand_there():
    with pytest.raises(ValueError, match="velvet"):
        dl.Bsdf.parse("velvet")
    with pytest.raises(ValueError, match="roughness"):
        dl.Material.parse("ggx:7000")


def test_functions_make_a_bsdf(rng):
    mine, theirs = diffuse(), dl.Bsdf.parse("diffuse:0.6")
    wo, wi = directions(rng, 100), directions(rng, 100)
    wi[0, 2] *= -1
    assert np.allclose(mine.eval(wo, wi), theirs.eval(wo, wi), rtol=1e-6)
    assert np.allclose(mine.pdf(wo, wi), theirs.pdf(wo, wi), rtol=1e-6)
    u = rng.random((100, 3), np.float32)
    assert np.allclose(mine.sample(wo, u)[1], 0.6, rtol=1e-5)
    dl.testing.chi2(lambda u: mine.sample(wo[0], u)[0], lambda w: mine.pdf(wo[0], w))


@pytest.mark.parametrize("strategy", ["brdf", "mis", "product:4", "rejection"])
def test_functions_render_like_the_library(strategy, env):
    """A built-in strategy asks a function direction by direction: same samples, same picture."""
    settings = dict(strategy=strategy, spp=4, size=(12, 12), adaptive=False)
    mine = dl.render(dl.Scene.builtin("sphere", material=diffuse()), env, **settings)
    theirs = dl.render(dl.Scene.builtin("sphere", material="diffuse:0.6"), env, **settings)
    assert np.allclose(mine.color, theirs.color, rtol=1e-3, atol=1e-4)


def test_a_function_that_raises_ends_the_render(env):
    def broken(wo, wi):
        raise KeyError("my own")

    scene = dl.Scene.builtin("sphere", material=dl.Bsdf.custom(broken))
    for strategy in ("brdf", dl.strategies.Environment(env)):
        with pytest.raises(KeyError, match="my own"):
            dl.render(scene, env, strategy, spp=2, size=(16, 16))
    shapes = dl.Scene.builtin("sphere", material=dl.Bsdf.custom(lambda wo, wi: np.ones((2, 2))))
    with pytest.raises(ValueError, match=r"the result of eval has shape \(2, 2\)"):
        dl.render(shapes, env, "brdf", spp=1, size=(8, 8))


@pytest.mark.parametrize("strategy", ["environment", "python"])
def test_a_failure_ends_its_render_and_no_other(env, strategy):
    """Two threads render the same scene; one call fails."""
    chosen = dl.strategies.Environment(env) if strategy == "python" else strategy
    settings = dict(strategy=chosen, size=(32, 32), threads=1, tile_size=16)
    calls, results = itertools.count(), {}

    def once(wo, wi):
        if next(calls) == (4 if strategy == "python" else 1000):
            raise KeyError("my own")
        return np.maximum(wi[:, 2], 0) * 0.6 / np.pi

    scene = dl.Scene.builtin("sphere", material=dl.Bsdf.custom(once))

    def work(seed):
        try:
            results[seed] = dl.render(scene, env, seed=seed, spp=2, **settings)
        except KeyError as error:
            results[seed] = error

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [type(result) for result in results.values()].count(KeyError) == 1
    for seed, result in results.items():
        # The function does not raise again.
        if isinstance(result, dl.Film):
            assert result == dl.render(scene, env, seed=seed, spp=2, **settings)


def test_progressive_ends_with_a_failure(env):
    for strategy in ("brdf", dl.strategies.Environment(env)):
        calls = itertools.count()

        def once(wo, wi):
            if next(calls) == 2:
                raise KeyError("my own")
            return wi[:, 2] * 0.6 / np.pi

        scene = dl.Scene.builtin("sphere", material=dl.Bsdf.custom(once))
        steps = dl.progressive(scene, env, strategy, spp=64, size=(16, 16), threads=1)
        with pytest.raises(KeyError, match="my own"):
            list(steps)
        assert list(steps) == []


def test_candidates_are_not_measured(env):
    """The pilot would take a minute."""
    film = dl.render(dl.Scene.builtin("sphere", material=diffuse()), env, "sir:2", spp=1, size=(4, 4))
    assert film.strategy == "sir:2/32"


def test_wrong_functions_are_refused(env):
    with pytest.raises(ValueError, match="eval is 3"):
        dl.Bsdf.custom(3)
    with pytest.raises(ValueError, match="belong together"):
        dl.Bsdf.custom(len, pdf=len)
    with pytest.raises(ValueError, match="albedo"):
        dl.Bsdf.custom(len, albedo=2)
    unbounded = dl.Scene.builtin("sphere", material=dl.Bsdf.custom(lambda wo, wi: wi[:, 2]))
    for value in (np.inf, np.nan, -1):
        pdf = lambda wo, wi: np.full(len(wi), value)
        endless = dl.Scene.builtin("sphere", material=dl.Bsdf.custom(lambda wo, wi: wi[:, 2], pdf, lambda wo, u: wo))
        with pytest.raises(ValueError, match="finite and not negative"):
            dl.render(endless, env, "brdf", spp=1, size=(8, 8))
    with pytest.raises(ValueError, match="max_eval"):
        dl.render(unbounded, env, "rejection", spp=1, size=(8, 8))


def test_texts_are_pickled():
    material = pickle.loads(pickle.dumps(dl.Material("ggx:0.2:gold")))
    assert repr(material) == 'Material(Bsdf.parse("ggx:0.2:gold"))'
    with pytest.raises(TypeError, match="functions"):
        pickle.dumps(diffuse())


def test_a_notebook_shows_the_lobe():
    for bsdf in (dl.Bsdf.parse("ggx:0.2:gold"), dl.Material("ward:0.1"), diffuse()):
        svg = bsdf._repr_svg_()
        assert svg.startswith("<svg") and "viewer at" in svg and "NaN" not in svg
