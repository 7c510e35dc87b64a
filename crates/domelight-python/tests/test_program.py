"""Films are those of the program, to the bit."""

import pathlib
import subprocess

import numpy as np
import OpenEXR
import pytest

import domelight as dl

STRATEGIES = [
    "brdf:2",
    "environment:2",
    "mis:2:1",
    "product:4",
    "rejection:8",
    "sir:2/16",
    "sir",
    "median-cut:16",
    "variance-minimization:16",
]


def channels(path):
    """The layers of an OpenEXR file as another reader reads them, by the names of Python's."""
    found = {}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for name, channel in file.channels().items():
            found[name] = np.array(channel.pixels)
    rgb = lambda prefix, parts="RGB": np.stack([found[f"{prefix}{c}"] for c in parts], axis=-1)
    return {
        "color": rgb(""),
        "alpha": found["A"],
        "unoccluded": rgb("unoccluded."),
        "shadow": rgb("shadow."),
        "albedo": rgb("albedo."),
        "normal": rgb("normal.", "XYZ"),
        "depth": found["depth.Z"],
        "variance": rgb("variance."),
        "samples": found["samples.Y"],
    }


def attributes(path):
    """How an OpenEXR file says that it was made."""
    with OpenEXR.File(str(path)) as file:
        return {name: value for name, value in file.header().items() if name.startswith("domelight.")}


def assert_same(film, path):
    for name, expected in channels(path).items():
        values = film[name].astype(np.float32) if name == "samples" else film[name]
        assert values.dtype == np.float32 and values.flags.c_contiguous
        assert values.shape == expected.shape, name
        assert np.array_equal(values.view(np.uint32), expected.view(np.uint32)), name


def without_job(attributes):
    """What only the program knows is the way to render the picture again: Python's scenes may be arrays."""
    return {name: value for name, value in attributes.items() if name not in ("domelight.job", "domelight.inputs")}


def test_every_strategy_is_covered():
    names = {name for name, _ in dl.strategy_names()}
    assert names == {text.split(":")[0] for text in STRATEGIES}


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_films_equal_the_programs(program, tmp_path, strategy):
    path = tmp_path / "program.exr"
    arguments = ["render", "statue", "--env", "cathedral", "--env-rows", "128", "--size", "48x40"]
    arguments += ["--spp", "8", "--seed", "5", "--strategy", strategy, "-o", str(path)]
    subprocess.run([program, "--quiet", *arguments], check=True)
    scene = dl.Scene.builtin("statue")
    env = dl.Environment.builtin("cathedral", rows=128)
    film = dl.render(scene, env, strategy, spp=8, size=(48, 40), seed=5)
    assert_same(film, path)
    # What Python writes is that, too: layers and attributes.
    film.save(tmp_path / "python.exr")
    assert_same(film, tmp_path / "python.exr")
    assert attributes(tmp_path / "python.exr") == without_job(attributes(path))
    # The pilot's choices are in the strategy's text.
    assert film == dl.render(scene, env, film.strategy, spp=8, size=(48, 40), seed=5)


def test_all_options_equal_the_programs(program, tmp_path):
    path = tmp_path / "program.exr"
    arguments = ["render", "material-ball", "--material", "ggx:0.3:gold", "--ground", "--hide-env"]
    arguments += ["--env", "studio", "--env-rows", "64", "--env-rotate", "30", "--env-scale", "2"]
    arguments += ["--size", "40x48", "--spp", "4", "--filter", "tent", "--sampler", "independent"]
    arguments += ["--origin", "0,1,6", "--fov", "30", "--no-adaptive", "-o", str(path)]
    subprocess.run([program, "--quiet", *arguments], check=True)
    scene = dl.Scene.builtin("material-ball", material="ggx:0.3:gold", ground=True)
    env = dl.Environment.builtin("studio", rows=64, rotation=30, scale=2)
    camera = dl.Camera(origin=(0, 1, 6), fov=30)
    film = dl.render(
        scene, env, size=(40, 48), spp=4, filter="tent", sampler="independent", camera=camera,
        adaptive=False, hide_env=True,
    )
    assert_same(film, path)


@pytest.mark.parametrize("scene", ["statue", "spheres"])
def test_the_scenes_own_light_and_camera_are_the_programs(program, tmp_path, scene):
    path = tmp_path / "program.exr"
    arguments = ["render", scene, "--size", "32x32", "--spp", "2", "-o", str(path)]
    subprocess.run([program, "--quiet", *arguments], check=True)
    assert_same(dl.render(dl.Scene.builtin(scene), spp=2, size=(32, 32)), path)


def test_files_equal_the_programs(program, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mesh = pathlib.Path("tiny.obj")
    # So small that it is scaled for tracing.
    mesh.write_text("v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 -0.01\nf 1 2 3\nf 1 3 4\n")
    probe = pathlib.Path("probe.pfm")
    dl.write(probe, np.random.default_rng(1).random((8, 16, 3), np.float32))
    arguments = ["render", str(mesh), "--env", str(probe), "--size", "24x24", "--spp", "4"]
    for extension in ("exr", "png", "hdr", "pfm"):
        arguments += ["-o", str(tmp_path / f"program.{extension}")]
    subprocess.run([program, "--quiet", *arguments], check=True)
    film = dl.render(dl.Scene.load(mesh), dl.Environment.load(probe), spp=4, size=(24, 24))
    assert_same(film, tmp_path / "program.exr")
    for extension in ("png", "hdr", "pfm"):
        film.save(tmp_path / f"python.{extension}")
        bytes_of = lambda who: (tmp_path / f"{who}.{extension}").read_bytes()
        assert bytes_of("python") == bytes_of("program"), extension
    film.save(tmp_path / "python.exr")
    assert attributes(tmp_path / "python.exr") == without_job(attributes(tmp_path / "program.exr"))
    # Pictures name no folder of this machine.
    film = dl.render(dl.Scene.load(tmp_path / mesh), dl.Environment.load(tmp_path / probe), spp=1, size=(8, 8))
    film.save("absolute.exr")
    assert attributes("absolute.exr")["domelight.scene"] == "tiny.obj"
    assert attributes("absolute.exr")["domelight.environment"] == "probe.pfm"


def test_pictures_are_developed_as_the_program_does(program, tmp_path, sphere, env):
    film = dl.render(sphere, env, "mis", spp=2, size=(24, 16), hide_env=True)
    film.save(tmp_path / "film.exr")
    kept = attributes(tmp_path / "film.exr")["domelight.exposure"]
    assert kept == f"{film.exposure:g}" and film.exposure != 0
    for name, arguments, settings in [
        ("automatic", [], {}),
        ("as_it_is", ["--exposure", "0", "--tone", "standard"], dict(exposure=0, curve="standard")),
        ("fine", ["--exposure", "1.5", "--bits", "16"], dict(exposure=1.5, bits=16)),
    ]:
        path = tmp_path / f"{name}.png"
        command = [program, "--quiet", "tone", str(tmp_path / "film.exr"), *arguments, "-o", str(path)]
        subprocess.run(command, check=True)
        film.save(tmp_path / "python.png", **settings)
        assert path.read_bytes() == (tmp_path / "python.png").read_bytes() == film.to_png(**settings), name
