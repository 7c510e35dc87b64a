"""Whatever comes in, what comes out is a result or an exception that says what is wrong."""

import inspect
import json
import pickle
import re
from typing import get_args, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import domelight as dl
from domelight import _domelight, _names, _options

ENV = dl.Environment(np.random.default_rng(3).random((6, 12, 3)))
BSDF = dl.Bsdf.parse("ggx:0.3")
SPHERE = dl.Scene.builtin("sphere")
FILM = dl.render(SPHERE, ENV, spp=1, size=(4, 4))
DTYPES = [np.float16, np.float32, np.float64, np.int8, np.uint16, np.int64, ">f4", ">f8"]

arrays = st.one_of(
    hnp.arrays(
        st.sampled_from([np.dtype(d) for d in DTYPES]),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
    ),
    hnp.arrays(
        st.sampled_from([np.dtype(d) for d in (bool, complex, "U3", "S2", object, "datetime64[s]")]),
        hnp.array_shapes(min_dims=0, max_dims=2, min_side=0, max_side=3),
    ),
)
anything = st.one_of(arrays, st.none(), st.text(max_size=3), st.integers(), st.floats(), st.just({}))

# What may be raised; nothing else, and no crash.
REFUSALS = (ValueError, TypeError, OverflowError)
FUNCTIONS = [
    lambda a, b: ENV.sample(a),
    lambda a, b: ENV.radiance(a),
    lambda a, b: ENV.pdf(a),
    lambda a, b: ENV.uv(a),
    lambda a, b: ENV.directions(a),
    lambda a, b: dl.Environment(a, rotation=b),
    lambda a, b: dl.Density(ENV, a),
    lambda a, b: BSDF.eval(a, b),
    lambda a, b: BSDF.sample(a, b),
    lambda a, b: dl.Scene(a, b),
    lambda a, b: dl.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], normals=a, colors=b),
    lambda a, b: dl.Camera(origin=a, target=b),
    lambda a, b: dl.Camera(shift=a, aperture=b, focus_distance=1),
    lambda a, b: dl.metrics.compare(a, b),
    lambda a, b: dl.metrics.flip(a, b),
    lambda a, b: dl.tone_map(a, exposure=b),
    lambda a, b: dl.render(dl.Scene([[0, 0, 0]], []), ENV, a, size=b),
    lambda a, b: dl.lights(ENV, a, min_share=b),
    lambda a, b: dl.lights(ENV, 2, threads=a, lamps=b),
    lambda a, b: FILM.to_png(exposure=a, bits=b),
    lambda a, b: dl.render(SPHERE, ENV, spp=1, size=(2, 2), time=a, progress=b),
]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@settings(max_examples=600, deadline=None, derandomize=True)
@given(st.sampled_from(FUNCTIONS), anything, anything)
def test_anything_gives_a_result_or_an_exception(function, a, b):
    try:
        function(a, b)
    except REFUSALS as error:
        assert str(error)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(hnp.arrays(np.float32, hnp.array_shapes(min_dims=1, max_dims=3, max_side=5).map(lambda s: (*s, 3)),
                  elements=st.floats(-2, 2, width=32)), st.data())
def test_strides_do_not_matter(wi, data):
    expected = ENV.pdf(wi)
    assert expected.shape == wi.shape[:-1]
    for other in (np.asfortranarray(wi), wi.astype(np.float64), wi.astype(">f4"), wi.tolist()):
        assert np.array_equal(ENV.pdf(other), expected)
    backward = wi[::-1]
    assert np.array_equal(ENV.pdf(backward), expected[::-1])
    wide = np.zeros((*wi.shape[:-1], 6), np.float32)
    wide[..., ::2] = wi
    assert np.array_equal(ENV.pdf(wide[..., ::2]), expected)
    frozen = wi.copy()
    frozen.flags.writeable = False
    assert np.array_equal(ENV.pdf(frozen), expected)
    axis = data.draw(st.integers(0, wi.ndim - 1))
    assert np.array_equal(ENV.pdf(np.broadcast_to(wi, (2, *wi.shape))), np.stack([expected] * 2)), axis


def test_empty_arrays_give_empty_arrays():
    nothing = np.empty((0, 3))
    assert ENV.pdf(nothing).shape == (0,) and ENV.radiance(nothing).shape == (0, 3)
    assert BSDF.eval(nothing, nothing).shape == (0, 3)
    assert BSDF.eval([0, 0, 1], nothing).shape == (0, 3)
    assert [a.shape for a in BSDF.sample(nothing, nothing)] == [(0, 3), (0, 3), (0,)]


def test_inputs_are_not_changed(rng):
    wi = rng.normal(size=(5, 3)).astype(np.float32)
    before = wi.copy()
    ENV.pdf(wi), BSDF.eval(wi, wi), dl.Scene(wi, [[0, 1, 2]], normalize=True)
    assert np.array_equal(wi, before)


def test_not_a_number_is_refused():
    with pytest.raises(ValueError, match=r"wo\[0\] is NaN; it must be finite"):
        BSDF.eval([np.nan, 0, 1], [[0, 0, 1]])
    with pytest.raises(ValueError, match=r"wi\[1, 0\] is inf"):
        ENV.pdf([[0, 0, 1], [np.inf, 0, 0]])
    with pytest.raises(ValueError, match=r"vertices\[1, 2\] is NaN"):
        dl.Scene([[0, 0, 0], [0, 0, np.nan]], [])


def test_scenes_of_arrays(env):
    quad = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    faces = [[0, 1, 2], [0, 2, 3]]
    scene = dl.Scene(quad, faces, normals=[[0, 0, 2]] * 4, material=dl.Material("diffuse:0.8"))
    assert scene.n_triangles == 2 and np.array_equal(scene.bounds, [[-1, -1, 0], [1, 1, 0]])
    white = dl.Environment(np.ones((4, 8, 3)))
    film = dl.render(scene, white, "brdf:4", spp=16, size=(16, 16), hide_env=True)
    seen = film.alpha == 1
    assert seen.any() and np.allclose(film.color[seen], 0.8, rtol=1e-4)
    red = dl.Scene(quad, faces, colors=[[1, 0, 0]] * 4)
    film = dl.render(red, white, spp=4, size=(16, 16), hide_env=True)
    assert np.allclose(film["albedo"][seen], [1, 0, 0])
    assert dl.Scene([], []).bounds is None
    assert dl.Scene(np.empty((0, 3)), np.empty((0, 3), int)).n_triangles == 0


@pytest.mark.parametrize(
    "arguments, words",
    [
        (([[0, 0]], []), r"vertices has shape \(1, 2\)"),
        (([[0, 0, 0]], [[0, 0, 1]]), "faces holds 1"),
        (([[0, 0, 0]], [[0, 0, -1]]), "faces holds -1"),
        (([[0, 0, 0]], [[0.0, 0.0, 0.0]]), "faces has dtype float64"),
        (([[0, 0, 0]], [0, 0, 0]), r"faces has shape \(3,\)"),
        (([[0, 0, 0]], [[0, 0, 2**70]]), "faces"),
        (([[1e30, 0, 0], [0, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "across"),
    ],
)
def test_wrong_meshes_are_named(arguments, words):
    with pytest.raises(ValueError, match=words):
        dl.Scene(*arguments)


@pytest.mark.parametrize(
    "attributes, words",
    [
        (dict(normals=[[0, 0, 1]]), r"normals has shape \(1, 3\)"),
        (dict(normals=[[0, 0, 0]] * 3), r"normals\[0\]"),
        (dict(colors=[[2, 0, 0]] * 3), r"colors\[0\]"),
        (dict(uvs=[[0, 0, 0]] * 3), "uvs has shape"),
        (dict(material="velvet"), "velvet"),
        (dict(up="x"), "up is"),
    ],
)
def test_wrong_attributes_are_named(attributes, words):
    with pytest.raises(ValueError, match=words):
        dl.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], **attributes)


def test_the_line_of_a_scene_file_that_names_a_missing_map_is_named(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text('[environment]\nfile = "none.hdr"\n\n[[objects]]\nbuiltin = "sphere"\n')
    scene = dl.Scene.load(path)
    with pytest.raises(FileNotFoundError, match=r"none\.hdr, which .*scene\.toml, line 1, \[environment\]"):
        scene.environment()


def test_messages_name_the_argument(env):
    def refused(match, function, *args, error=ValueError, **kwargs):
        with pytest.raises(error, match=match):
            function(*args, **kwargs)

    for render in (dl.render, dl.progressive):
        refused(r"size: '8' is not a size such as", render, SPHERE, env, size=8)
        refused(r"size: '8,8,3' is not a size", render, SPHERE, env, size=(8, 8, 3))
        refused(r"size: '8.0,8' is not a size", render, SPHERE, env, size=(8.0, 8))
        refused(r"size: '0,4' is not a size", render, SPHERE, env, size=np.array([0, 4]))
        refused(r"spp: '-1' is not a whole number from 1 to 16777216", render, SPHERE, env, spp=-1)
        refused(r"spp: '2.0' is not a whole number", render, SPHERE, env, spp=2.0)
        refused(r"spp: invalid type: null", render, SPHERE, env, spp=None)
        refused(r"seed: '-3' is not a whole number", render, SPHERE, env, seed=-3)
        refused(r"target_error: 'nan' is not a number above 0", render, SPHERE, env, target_error=float("nan"))
        refused(r"hide_env: invalid type", render, SPHERE, env, hide_env="yes")
        refused(r"\(\) has no argument 'samples'", render, SPHERE, env, samples=3, error=TypeError)
        refused(r"1.5 is no camera; give a Camera", render, SPHERE, env, camera=1.5, error=TypeError)
    refused(r"strategies is 'mis'; it must be a list, such as \['mis'\]", dl.compare, SPHERE, env, "mis")
    refused(r"seeds is 0", dl.compare, SPHERE, env, ["mis"], seeds=0)
    refused(r"reference_spp is -2", dl.compare, SPHERE, env, ["mis"], reference_spp=-2)
    refused(r"pixel is 3; it must be \(column, row\)", dl.inspect, SPHERE, env, pixel=3)
    refused(r"strategies is 'mis'", dl.inspect, SPHERE, env, pixel=(1, 1), strategies="mis")
    refused(r"5 is no material; give a text such as 'diffuse:0.5'", dl.Material, 5, error=TypeError)
    refused(r"n_rays is 0; it must be a whole number", dl.strategy, n_rays=0)


def test_warnings_point_at_the_caller(tmp_path):
    path = tmp_path / "negative.pfm"
    path.write_bytes(b"PF\n2 1\n-1.0\n" + np.array([1, 1, 1, -1, 1, 1], "<f4").tobytes())
    with pytest.warns(dl.DomelightWarning, match="repaired") as caught:
        dl.Environment.load(path)
    assert {warning.filename for warning in caught} == {__file__}
    few = dict(budget="spp:1", seeds=1, reference_spp=1, size=(4, 4))
    with pytest.warns(dl.DomelightWarning) as caught:
        dl.compare(SPHERE, ENV, {"none": lambda points: ([], np.empty((0, 3)), [])}, **few | {"budget": "rays:1"})
    assert {warning.filename for warning in caught} == {__file__}
    assert any("too few for a budget of rays" in str(warning.message) for warning in caught)


def refusal(call):
    with pytest.raises((ValueError, KeyError)) as error:
        call()
    return str(error.value)


def test_the_options_for_type_checkers_are_those_of_jobs():
    sections = {option["name"]: option["field"].split(".")[0] for option in json.loads(_domelight.job_options())}
    pictures = {"size", "hide_env", *(name for name, section in sections.items() if section == "pixel")}
    renders = {name for name, section in sections.items() if section == "sampling"} - {"strategy"}
    assert set(get_type_hints(_options.PictureOptions)) == pictures
    assert set(get_type_hints(_options.RenderOptions)) == pictures | renders


def test_options_of_jobs_are_keywords():
    parameters = inspect.signature(dl.render).parameters
    assert [*parameters][:5] == ["scene", "env", "strategy", "size", "hide_env"]
    assert (parameters["spp"].default, parameters["size"].default) == (32, (640, 640))
    assert inspect.signature(dl.progressive).parameters["passes"].default == "doubling"
    assert inspect.signature(dl.compare).parameters["size"].default == (256, 256)
    assert "spp" not in inspect.signature(dl.inspect).parameters
    for name in _options.RenderOptions.__annotations__:
        assert f"\n{name} : " in inspect.getdoc(dl.render)
    assert "seed : int, default 0\n    Seed of the random numbers; the same seed" in inspect.getdoc(dl.render)
    numbers = {"size": np.array([4, 4]), "spp": np.int64(2), "seed": np.uint8(7), "hide_env": np.True_}
    film = dl.render(SPHERE, ENV, target_error=np.float32(0.1), **numbers)
    same = dl.render(SPHERE, ENV, size=[4, 4], spp=2, seed=7, hide_env=True, target_error=0.1)
    assert np.array_equal(film.color, same.color) and film.color.shape == (4, 4, 3)


def test_options_of_scenes_are_those_of_jobs():
    defaults = {option["name"]: option["default"] for option in json.loads(_domelight.job_options())}
    changes = {"ground", "normalize", "portal"}
    for constructor, options in [
        (dl.Scene, changes),
        (dl.Scene.builtin, changes),
        (dl.Scene.load, {*changes, "scene", "animation", "at", "strict"}),
    ]:
        parameters = inspect.signature(constructor).parameters
        assert options <= parameters.keys()
        assert all((parameters[name].default or None) == (defaults[name] or None) for name in options)
    for wrong, words in [({"ground": "hole"}, "not one of plate, shadow"), ({"portal": "1,2"}, "is no portal")]:
        with pytest.raises(ValueError, match=words):
            dl.Scene.builtin("sphere", **wrong)
    for wrong in ({"spp": 3}, {"at": 1.0}, {"velvet": 1}):
        with pytest.raises(TypeError, match="scenes have no argument"):
            dl.Scene.builtin("sphere", **wrong)
    shadow = dl.Scene.builtin("sphere", ground="shadow")
    assert pickle.loads(pickle.dumps(shadow)) == shadow != dl.Scene.builtin("sphere", ground=True)
    assert dl.Scene.builtin("sphere", ground=False) == SPHERE


def test_options_of_environments_are_those_of_jobs(tmp_path):
    fields = {option["field"]: option for option in json.loads(_domelight.job_options())}
    path = tmp_path / "map.exr"
    dl.write(path, ENV.map)
    for constructor, name, extra in [
        (dl.Environment.builtin, "sky", {"rows"}),
        (dl.Environment.load, path, {"convention", "mapping", "faces", "window", "layer", "strict"}),
    ]:
        parameters = set(inspect.signature(constructor).parameters) - {"name", "path"}
        assert parameters == {"rotation", "scale", "exposure", "up", *extra}
        assert all(f"light.{parameter.replace('rotation', 'rotate')}" in fields for parameter in parameters)
        for wrong, words in [
            ({"rotation": "auto"}, "rotation is auto"),
            ({"scale": -1}, "scale: '-1'"),
            ({"up": "x"}, "up: 'x'"),
            ({"exposure": np.inf}, "exposure: 'inf'"),
        ]:
            with pytest.raises(ValueError, match=words):
                constructor(name, **wrong)
        for wrong in ({"spp": 3}, {"env_scale": 1.0}, {"rotate": 3.0}):
            with pytest.raises(TypeError, match="environments have no argument"):
                constructor(name, **wrong)
        plain, changed = constructor(name), constructor(name, rotation=30, scale=0.5, exposure=1, up="z")
        assert (changed.rotation, changed.up) == (30, "z") and np.allclose(changed.map, plain.map)
    with pytest.raises(ValueError, match="rows: '0'"):
        dl.Environment.builtin("sky", rows=0)
    turned = dl.Environment.load(path, convention="mitsuba")
    assert (turned.rotation - ENV.rotation) % 360 == 180


def test_the_names_for_type_checkers_are_those_of_the_engine():
    tiny = {"spp": 1, "size": (2, 2)}
    picture = np.ones((2, 2, 3))
    for names, use in [
        (_names.Filter, lambda name: dl.render(SPHERE, ENV, filter=name, **tiny)),
        (_names.Sampler, lambda name: dl.render(SPHERE, ENV, sampler=name, **tiny)),
        (_names.Passes, lambda name: dl.render(SPHERE, ENV, passes=name, **tiny)),
        (_names.Curve, lambda name: dl.tone_map(picture, curve=name)),
        (_names.Layer, lambda name: FILM[name]),
        (_names.Up, lambda name: dl.Environment(ENV.map, up=name)),
        (_names.Ground, lambda name: dl.Scene.builtin("sphere", ground=name)),
    ]:
        known = get_args(names)
        for name in known:
            use(name)
        # The message ends with all that the engine knows.
        message = refusal(lambda use=use: use("velvet"))
        listed = set(re.findall(r"[a-z-]+", re.split(r" (?:are|be|one of) ", message)[-1]))
        assert listed - {"and", "or"} == set(known), message
