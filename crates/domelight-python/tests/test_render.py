"""Renders: films, interruption, progress, threads, processes."""

import copy
import importlib.util
import itertools
import multiprocessing
import os
import pickle
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import domelight as dl

SMALL = dict(spp=4, size=(32, 24))


def test_films_have_all_layers(sphere, env):
    film = dl.render(sphere, env, **SMALL)
    assert film.shape == (24, 32) and film.complete and film.strategy == "product:8"
    assert list(film) == film.keys() and "variance" in film and "velvet" not in film
    for name in film:
        values = film[name]
        assert values.shape[:2] == (24, 32) and values.flags.c_contiguous and values.flags.writeable
        assert values.dtype == (np.uint32 if name in ("samples", "hits") else np.float32)
    assert np.array_equal(film.color, film["color"]) and np.array_equal(film.alpha, film["alpha"])
    with pytest.raises(KeyError, match="velvet"):
        film["velvet"]
    assert 0 < film.shading_points < film.camera_rays and film.shadow_rays > 0
    assert film.non_finite == 0


def test_a_notebook_shows_the_picture(sphere, env, tmp_path):
    film = dl.render(sphere, env, hide_env=True, **SMALL)
    png = film._repr_png_()
    assert png.startswith(b"\x89PNG") and png == film.to_png()
    assert film.to_png(exposure=2) != png
    assert film.alpha.min() == 0
    assert film.to_png(bits=16)[24] == 16 and film.to_png(exposure=film.exposure) == png
    film.save(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == png
    with pytest.raises(ValueError, match="must end in"):
        film.save(tmp_path / "a.tiff")
    with pytest.raises(ValueError, match="velvet"):
        film.to_png(curve="velvet")
    with pytest.raises(ValueError, match="bits is 12"):
        film.to_png(bits=12)
    with pytest.raises(ValueError, match="exposure is NaN"):
        film.save(tmp_path / "a.png", exposure=np.nan)
    with pytest.raises(OSError):
        film.save(tmp_path / "nowhere" / "a.exr")


def test_the_exposure_is_the_scenes(sphere, env):
    film = dl.render(sphere, env, **SMALL)
    assert film.exposure == dl.render(sphere, env, "brdf", spp=1, size=(32, 24), seed=7).exposure
    dim = dl.render(sphere, env.scaled(0.25), **SMALL)
    assert dim.exposure == pytest.approx(film.exposure + 2, abs=0.02)
    assert pickle.loads(pickle.dumps(dim)).exposure == dim.exposure
    steps = dl.progressive(sphere, env, **SMALL)
    assert {step.exposure for step in steps} == {film.exposure}
    # Of a BSDF in Python the first film decides.
    own = dl.Bsdf.custom(lambda wo, wi: np.float32(0.1) * wi[:, 2])
    scene = dl.Scene([[-1, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 1, 2]], material=own)
    films = list(dl.progressive(scene, env, dl.strategies.Environment(env), spp=4, size=(16, 16)))
    assert len(films) > 1 and len({film.exposure for film in films}) == 1 and films[0].exposure != 0


def test_time_ends_a_render(sphere, env):
    film = dl.render(sphere, env, "mis", spp=1 << 20, size=(48, 48), time=0.1)
    assert not film.complete and 0 < film.camera_rays < 48 * 48 << 20
    assert dl.render(sphere, env, time=1000, **SMALL) == dl.render(sphere, env, **SMALL)
    for wrong in (0, -1, np.inf, np.nan, 1e300):
        with pytest.raises(ValueError, match="time is"):
            dl.render(sphere, env, time=wrong, **SMALL)


def test_a_film_without_noise(sphere, env, tmp_path, monkeypatch):
    film = dl.render(sphere, env, "brdf", hide_env=True, spp=1, size=(64, 64))
    with monkeypatch.context() as patch:
        patch.setenv("OIDN_LIBRARY", str(tmp_path / "nothing.so"))
        with pytest.raises(ImportError, match="nothing.so.*pyoidn"):
            film.denoise()
        with pytest.raises(ImportError):
            film.save(tmp_path / "a.png", denoise=True)
        assert not (tmp_path / "a.png").exists()
    pytest.importorskip("pyoidn", reason="needs `pip install pyoidn`")
    clean = film.denoise()
    reference = dl.render(sphere, env, "mis:4:4", hide_env=True, spp=64, size=(64, 64)).color
    assert clean.shape == film.color.shape and clean.dtype == np.float32
    error = lambda picture: dl.metrics.rel_mse_trimmed(picture, reference)
    assert error(clean) < 0.5 * error(film.color)
    film.save(tmp_path / "a.exr", denoise=True)
    assert np.array_equal(dl.read(tmp_path / "a.exr", layer="denoised"), clean)
    assert np.array_equal(dl.read(tmp_path / "a.exr"), film.color)
    film.save(tmp_path / "a.pfm", denoise=True)
    assert np.array_equal(dl.read(tmp_path / "a.pfm"), clean)


def test_threads_and_tiles_change_no_bit(sphere, env):
    films = [dl.render(sphere, env, "mis", threads=t, tile_size=s, **SMALL) for t, s in [(1, 16), (3, 7)]]
    assert films[0] == films[1]
    assert films[0] != dl.render(sphere, env, "mis", seed=1, **SMALL)
    product = [dl.render(sphere, env, threads=t, **SMALL) for t in (1, 2)]
    assert product[0] == product[1]
    assert len({*films, *product}) == 2


def test_a_viewer_gets_the_picture(sphere, env):
    received = bytearray()

    def view(server):
        connection, _ = server.accept()
        with connection:
            while block := connection.recv(1 << 16):
                received.extend(block)

    with socket.create_server(("127.0.0.1", 0)) as server:
        viewer = threading.Thread(target=view, args=(server,))
        viewer.start()
        film = dl.render(sphere, env, **SMALL, display=f"127.0.0.1:{server.getsockname()[1]}")
        viewer.join()
    # The picture is opened first; its red values arrive as they are in the film.
    assert received[4] == 4
    assert np.ascontiguousarray(film.color[..., 0]).tobytes() in bytes(received)
    with pytest.raises(ConnectionError, match="no viewer listens"):
        dl.render(sphere, env, **SMALL, display="127.0.0.1:1")


@pytest.mark.parametrize("strategy", ["product:4", "environment:2", "sir"])
@pytest.mark.parametrize("passes", ["doubling", "efficient"])
def test_progressive_ends_in_the_same_bits(sphere, env, strategy, passes):
    settings = dict(spp=24 if strategy == "sir" else 100, size=(24, 24), passes=passes)
    films = list(dl.progressive(sphere, env, strategy, **settings))
    assert films[-1] == dl.render(sphere, env, strategy, **settings)
    assert [film.complete for film in films] == [False] * (len(films) - 1) + [True]
    assert len(films) > 1
    samples = [film["samples"].mean() for film in films]
    assert samples == sorted(samples)


def test_progressive_films_of_product_double(sphere, env):
    films = list(dl.progressive(sphere, env, "product:4", spp=16, size=(24, 24), adaptive=False))
    # Some pixels have a second set, which shows the variance.
    assert [film["samples"].mean() for film in films] == pytest.approx([1, 2, 4, 8, 16], rel=0.03)


@pytest.mark.parametrize("n", [1, 2, 16])
def test_progressive_films_of_functions_double(sphere, env, n):
    films = dl.progressive(sphere, env, dl.strategies.Environment(env, n), spp=40, size=(24, 24))
    assert [film["samples"].max() for film in films] == [1, 2, 4, 8, 16, 32, 40]


def test_progressive_can_be_left_and_ends_once(sphere, env):
    steps = dl.progressive(sphere, env, "brdf", spp=64, size=(16, 16))
    assert steps.film is None
    assert next(steps) == steps.film
    del steps
    steps = dl.progressive(sphere, env, "brdf", spp=1, size=(16, 16))
    assert len(list(steps)) == 1 and list(steps) == []


def test_target_error_ends_early(sphere, env):
    film = dl.render(sphere, env, "mis", spp=4096, size=(16, 16), target_error=0.1)
    assert film.complete and film["samples"].max() < 4096


def test_films_are_pickled(sphere, env, tmp_path):
    film = dl.render(sphere, env, hide_env=True, **SMALL)
    other = pickle.loads(pickle.dumps(film))
    assert other == film and repr(other) == repr(film)
    for name in film:
        assert np.array_equal(other[name], film[name])
    assert other.to_png() == film.to_png()
    with pytest.raises(ValueError, match="pickled film"):
        dl.Film._restore(b"no film")


def test_films_as_datasets(sphere, env):
    pytest.importorskip("xarray")
    film = dl.render(sphere, env, **SMALL)
    data = film.to_xarray()
    assert data["color"].dims == ("y", "x", "channel") and data["depth"].dims == ("y", "x")
    assert np.array_equal(data["variance"].values, film["variance"])


def test_dlpack(sphere, env):
    film = dl.render(sphere, env, **SMALL)
    assert np.array_equal(np.from_dlpack(film.color), film.color)

    class Foreign:
        """An array of a library that speaks DLPack alone."""

        def __init__(self, array):
            self.array = array

        def __dlpack__(self, **keywords):
            return self.array.__dlpack__(**keywords)

        def __dlpack_device__(self):
            return self.array.__dlpack_device__()

    wi = np.float32([[0, 1, 0], [1, 0, 0]])
    assert np.array_equal(env.radiance(Foreign(wi)), env.radiance(wi))


def test_jax_arrays():
    """In a process of its own: JAX starts threads that a later fork would miss."""
    if importlib.util.find_spec("jax") is None:
        pytest.skip("jax is not installed")
    script = """if True:
        import domelight as dl, jax, numpy as np
        env = dl.Environment.builtin("studio", rows=16)
        wi = jax.numpy.asarray([[0.0, 1.0, 0.0]])
        assert np.array_equal(env.radiance(wi), env.radiance(np.asarray(wi)))
        assert np.array_equal(np.asarray(jax.dlpack.from_dlpack(env.map)), env.map)
    """
    subprocess.run([sys.executable, "-c", script], check=True)


def test_cameras(sphere, env):
    own = sphere.camera(4 / 3)
    same = dl.render(sphere, env, camera=own, **SMALL)
    assert same == dl.render(sphere, env, **SMALL)
    assert own.fov == 40 or own.fov > 0
    away = dl.Camera(origin=(0, 0, 50))
    assert dl.render(sphere, env, camera=away, **SMALL)["hits"].sum() < same["hits"].sum()
    ortho = dl.render(sphere, env, camera=dl.Camera(ortho=2), **SMALL)
    assert ortho["hits"].mean() > 0.4
    for camera, words in [
        (dl.Camera(fov=180), "180"),
        (dl.Camera(origin=(0, 0, 0), target=(0, 0, 0)), "same point"),
        (dl.Camera(up=(0, 0, 0)), "up"),
        (dl.Camera(origin=(0, np.nan, 0)), "origin"),
        (dl.Camera(ortho=2, aperture=0.1, focus_distance=3), "no lens"),
        (7, "no camera 7"),
        ("front", 'no camera "front"'),
    ]:
        with pytest.raises(ValueError, match=words):
            dl.render(sphere, env, camera=camera, **SMALL)
    with pytest.raises(ValueError, match="both"):
        dl.Camera(fov=30, ortho=2)
    with pytest.raises(ValueError, match=r"origin has shape \(2,\)"):
        dl.Camera(origin=(0, 1))


def test_a_shifted_camera_sees_a_window_of_the_same_image_plane(sphere, env):
    common = {"origin": (0, 0, 4), "target": (0, 0, 0), "up": (0, 1, 0)}
    wide = {"filter": "box", "spp": 256, "seed": 1, "hide_env": True}
    whole = dl.render(sphere, env, camera=dl.Camera(**common, ortho=4), size=(64, 64), **wide)
    # The right upper quarter: its middle is half of its size away.
    quarter = dl.Camera(**common, ortho=2, shift=(0.5, 0.5))
    part = dl.render(sphere, env, camera=quarter, size=(32, 32), **wide)
    expected = whole.alpha[:32, 32:]
    assert abs(part.alpha.mean() - expected.mean()) < 0.01 and 0 < expected.mean() < 1
    assert quarter.shift == (0.5, 0.5) and "shift=(0.5, 0.5)" in repr(quarter)


def test_a_lens_blurs_what_is_out_of_focus(sphere, env):
    common = {"origin": (0, 0, 4), "target": (0, 0, 0), "up": (0, 1, 0), "fov": 40}
    common_settings = {"size": (48, 48), "spp": 64, "filter": "box", "hide_env": True}
    pinhole = dl.render(sphere, env, camera=dl.Camera(**common), **common_settings).alpha
    closed = dl.Camera(**common, aperture=0, focus_distance=3)
    assert np.array_equal(dl.render(sphere, env, camera=closed, **common_settings).alpha, pinhole)
    lens = dl.Camera(**common, aperture=0.3, focus_distance=1.5, blades=6)
    assert (lens.aperture, lens.focus_distance, lens.blades) == (np.float32(0.3), 1.5, 6)
    blurred = dl.render(sphere, env, camera=lens, **common_settings).alpha
    partial = lambda alpha: ((alpha > 0.05) & (alpha < 0.95)).sum()
    assert partial(blurred) > 3 * partial(pinhole)
    for wrong, words in [
        ({"aperture": 0.1}, "focus_distance"),
        ({"focus_distance": 1}, "aperture"),
        ({"aperture": -1, "focus_distance": 1}, "aperture is -1"),
        ({"aperture": 1, "focus_distance": 0}, "focus_distance is 0"),
        ({"shift": (np.nan, 0)}, "shift"),
    ]:
        with pytest.raises(ValueError, match=words):
            dl.Camera(**wrong)


@pytest.mark.parametrize(
    "wrong, words",
    [
        (dict(spp=0), "spp: '0' is not"),
        (dict(size=(0, 4)), "size: '0,4' is not"),
        (dict(size=(-3, 4)), "size: '-3,4' is not"),
        (dict(size=(1 << 40, 1 << 40)), "size: "),
        (dict(threads=0), "threads is 0"),
        (dict(filter="velvet"), "velvet"),
        (dict(sampler="velvet"), "velvet"),
        (dict(strategy="velvet"), "velvet"),
        (dict(strategy=7), "strategy is 7"),
        (dict(strategy="brdf:65536", spp=1 << 24), "more points"),
        (dict(target_error=-1), "target_error: '-1' is not a number above 0"),
        (dict(tile_size=0), "tile_size is 0"),
    ],
)
def test_wrong_settings_are_named(sphere, env, wrong, words):
    with pytest.raises(ValueError, match=words):
        dl.render(sphere, env, **{**SMALL, **wrong})
    with pytest.raises(ValueError, match=words):
        dl.progressive(sphere, env, **{**SMALL, **wrong})


def interrupt(share):
    """Ctrl-C as soon as there is something to keep."""
    if 0 < share < 1:
        os.kill(os.getpid(), signal.SIGINT)


def interrupt_after(seconds):
    timer = threading.Timer(seconds, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    return time.monotonic() + seconds


@pytest.mark.parametrize("strategy", ["product", "mis", "python"])
def test_interruption_keeps_what_was_done(sphere, env, strategy):
    if strategy == "python":
        strategy = dl.strategies.Environment(env)
    with pytest.raises(dl.RenderInterrupted) as stopped:
        dl.render(sphere, env, strategy, spp=1 << 20, size=(64, 64), tile_size=16, progress=interrupt)
    film = stopped.value.film
    assert not film.complete and film.camera_rays > 0 and np.isfinite(film.color).all()
    assert isinstance(stopped.value, KeyboardInterrupt)


@pytest.mark.timing
@pytest.mark.parametrize("strategy", ["product", "mis", "sir:8/800", "python", "sir of one's own BSDF"])
def test_interruption_is_quick(strategy):
    """Within two tenths of a second, of the default size."""
    env = dl.Environment.builtin("sky")
    chosen = dl.strategies.Environment(env) if strategy == "python" else strategy.split(" of ")[0]
    own = dl.Bsdf.custom(lambda wo, wi: np.float32(0.5 / np.pi) * wi[:, 2], albedo=0.5, max_eval=0.5 / np.pi)
    scene = dl.Scene.builtin("statue", material=own if "own" in strategy else None)
    at = interrupt_after(1.5)
    with pytest.raises(dl.RenderInterrupted):
        dl.render(scene, env, chosen, spp=1 << 20)
    seconds = time.monotonic() - at
    print(f"\n{strategy}: {seconds:.3f} s from the interrupt to its exception")
    assert seconds < 0.2


@pytest.mark.parametrize("strategy", ["mis", "sir:2/8", "product"])
def test_tiles_that_an_interruption_cuts_short_are_rendered_again(env, strategy):
    """Functions of running tiles are no longer called after Ctrl-C, which leaves no trace in the film."""
    calls = itertools.count()

    def eval(wo, wi):
        if next(calls) in (3, 12):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.1)
        return np.float32(0.5 / np.pi) * wi[:, 2]

    own = dl.Bsdf.custom(eval, albedo=0.5, max_eval=0.5 / np.pi)
    scene = dl.Scene.builtin("sphere", material=own)
    settings = dict(spp=4, size=(40, 40), tile_size=16)
    steps = dl.progressive(scene, env, strategy, **settings)
    n_interrupted, film = 0, None
    while film is None or not film.complete:
        try:
            film = next(steps)
        except dl.RenderInterrupted:
            n_interrupted += 1
    assert n_interrupted > 0
    assert film == dl.render(scene, env, strategy, passes="doubling", **settings)


def test_progressive_goes_on_after_an_interruption(sphere, env):
    settings = dict(spp=512, size=(96, 96))
    interruptions = [interrupt]
    report = lambda share: interruptions and 0 < share < 1 and interruptions.pop()(share)
    steps = dl.progressive(sphere, env, "mis", progress=report, **settings)
    with pytest.raises(dl.RenderInterrupted) as stopped:
        for _ in steps:
            pass
    assert not stopped.value.film.complete
    for film in steps:
        pass
    assert film.complete and film == dl.render(sphere, env, "mis", **settings)


def test_other_threads_run_meanwhile(sphere, env):
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.wait(0.005):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    dl.render(sphere, env, "mis:4:4", spp=256, size=(128, 128), threads=1)
    stop.set()
    thread.join()
    assert len(ticks) > 10


def test_renders_at_the_same_time(sphere, env):
    results = {}

    def work(seed):
        results[seed] = dl.render(sphere, env, dl.strategies.Brdf(env), seed=seed, **SMALL)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    for seed, film in results.items():
        assert film == dl.render(sphere, env, "brdf", seed=seed, **SMALL)


def test_progress_is_reported(sphere, env):
    shares = []
    dl.render(sphere, env, "mis", spp=512, size=(96, 96), progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    dl.render(sphere, env, progress=True, **SMALL)
    shares.clear()
    for _ in dl.progressive(sphere, env, "mis", spp=512, size=(96, 96), progress=shares.append):
        pass
    assert shares == sorted(shares) and shares[-1] == 1.0

    def broken(share):
        raise LookupError("no more")

    with pytest.raises(LookupError, match="no more"):
        dl.render(sphere, env, "mis", spp=1 << 16, size=(64, 64), progress=broken)


def test_bars_end_with_the_work(sphere, env, capfd):
    pytest.importorskip("tqdm")
    dl.render(sphere, env, progress=True, **SMALL)
    list(dl.progressive(sphere, env, progress=True, **SMALL))
    bars = capfd.readouterr().err
    assert bars.count("100%") >= 2 and bars.endswith("\n"), bars


def _render_in_a_child(queue):
    sphere = dl.Scene.builtin("sphere")
    env = dl.Environment.builtin("studio", rows=64)
    queue.put(dl.render(sphere, env, **SMALL))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_forked_processes_render(sphere, env):
    film = dl.render(sphere, env, **SMALL)
    steps = dl.progressive(sphere, env, **SMALL)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_render_in_a_child, args=(queue,))
    child.start()
    assert queue.get(timeout=60) == film
    child.join(60)
    assert child.exitcode == 0
    # A render that was begun before the fork is refused, not waited for.
    pid = os.fork()
    if pid == 0:
        try:
            next(steps)
        except RuntimeError:
            os._exit(7)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 7
    assert next(steps) is not None


def _render_for_joblib(seed):
    return dl.render(dl.Scene.builtin("sphere"), dl.Environment.builtin("studio", rows=64), seed=seed, **SMALL)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("backend", ["loky", "multiprocessing", "threading"])
def test_joblib_renders(sphere, env, backend):
    joblib = pytest.importorskip("joblib")
    here = _render_for_joblib(0)
    films = joblib.Parallel(n_jobs=2, backend=backend, timeout=120)(
        joblib.delayed(_render_for_joblib)(seed) for seed in range(4)
    )
    assert films[0] == here and films[3] == dl.render(sphere, env, seed=3, **SMALL)


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc here")
def test_memory_is_given_back():
    """200 renders, with what they need made anew each time."""
    script = textwrap.dedent(
        """
        import domelight as dl, numpy as np, os
        def rss():
            with open("/proc/self/statm") as file:
                return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        def once(i):
            scene = dl.Scene.builtin("sphere")
            env = dl.Environment(1 + np.random.default_rng(i).random((32, 64, 3)))
            film = dl.render(scene, env, ["product", "mis", dl.strategies.Brdf(env)][i % 3], spp=1, size=(32, 32))
            film.color, film["depth"], film.to_png(), dl.lights(env, 8)
            next(dl.progressive(scene, env, spp=2, size=(16, 16)))
        for i in range(50):
            once(i)
        before = rss()
        for i in range(200):
            once(i)
        print((rss() - before) / 2**20)
        """
    )
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert float(found.stdout) < 8, f"{found.stdout} MiB more after 200 renders"


@pytest.mark.timing
def test_import_is_quick():
    """No more than 30 ms beyond NumPy's, the best of several tries."""
    script = "import time, numpy, numpy.typing; t = time.perf_counter(); import domelight; print(time.perf_counter() - t)"
    run = lambda: float(subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout)
    assert min(run() for _ in range(5)) < 0.03


def test_cameras_are_pickled_and_compared():
    full = dict(origin=(1, 2, 3), target=(0, 0.1, 0), up=(0, 0, 1), fov=33.3, shift=(0.1, -0.2), aperture=0.1,
                focus_distance=2.5, blades=6)
    for settings in ({}, {"ortho": 2.5}, full):
        camera = dl.Camera(**settings)
        for other in (pickle.loads(pickle.dumps(camera)), copy.deepcopy(camera), dl.Camera(**settings)):
            assert other == camera and hash(other) == hash(camera) and repr(other) == repr(camera)
        assert camera != dl.Camera(**{**settings, "shift": (0.5, 0)})


def test_films_say_how_many_samples_they_have(sphere, env):
    even = dl.render(sphere, env, "mis", spp=2, size=(8, 8))
    assert repr(even) == "<Film 8 x 8: mis:1:1, 2 samples>", repr(even)
    film = dl.render(sphere, env, "mis", spp=1 << 20, size=(8, 8), time=0.05)
    assert not film.complete
    assert f"{film['samples'].mean():.1f}".removesuffix(".0") + " of 1048576 samples, not complete" in repr(film)


def test_scenes_are_pickled_copied_and_compared(tmp_path):
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    colors = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    mesh = dl.Scene(corners, [[0, 1, 2]], colors=colors, up="z", name="a mesh")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    loaded = dl.Scene.load(tmp_path / "a.obj", material=dl.Material("ggx:0.3"), normalize=True)
    built = dl.Scene.builtin("spheres", ground=True, material="ward:0.1")
    for scene in (mesh, loaded, built):
        for other in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
            assert other == scene and hash(other) == hash(scene)
            assert repr(other) == repr(scene) and other.up == scene.up
            films = [dl.render(s, spp=1, size=(8, 8), seed=3) for s in (scene, other)]
            assert films[0] == films[1]
    # What is changed later changes neither scene nor pickle.
    before = pickle.dumps(mesh)
    colors[0] = 1
    assert pickle.loads(before) == mesh == pickle.loads(pickle.dumps(mesh))
    assert built != dl.Scene.builtin("spheres", material="ward:0.1") and built != mesh and mesh != "a mesh"
