"""Asks Mitsuba 3 itself whether environments arrive as they are: python mitsuba_check.py, where both are installed."""

import mitsuba
import numpy as np

import domelight as dl

mitsuba.set_variant("scalar_rgb")
rng = np.random.default_rng(1)
for up in ("y", "z"):
    env = dl.Environment(rng.random((16, 32, 3), dtype=np.float32), rotation=35.0, up=up)
    emitter = mitsuba.load_dict(env.to_mitsuba())
    back = dl.Environment.from_mitsuba(emitter)
    assert np.array_equal(back.map, env.map) and back.up == up and abs(back.rotation - 35.0) < 1e-3

    # Mitsuba interpolates: a map of broad features, at any direction.
    wi = rng.normal(size=(500, 3))
    wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)
    columns, rows = np.meshgrid(np.arange(256) + 0.5, np.arange(128) + 0.5)
    centers = env.directions(np.stack([columns / 256, rows / 128], axis=-1))
    smooth = dl.Environment(0.5 + 0.5 * centers, rotation=35.0, up=up)
    emitter = mitsuba.load_dict(smooth.to_mitsuba())
    interaction = mitsuba.SurfaceInteraction3f()

    def seen(direction):
        interaction.wi = -mitsuba.Vector3f(*(float(x) for x in direction))
        return np.array(emitter.eval(interaction))

    theirs = np.stack([seen(w) for w in wi])
    error = np.abs(theirs - smooth.radiance(wi)).max()
    assert error < 0.05, error
    print(f"up {up}: Mitsuba {mitsuba.__version__} sees the same light, within {error:.3f} of 1")

light = mitsuba.load_dict({"type": "constant", "radiance": {"type": "rgb", "value": [1, 2, 3]}})
assert np.allclose(dl.Environment.from_mitsuba(light).radiance([0, 0, 1]), [1, 2, 3])
picture = mitsuba.Bitmap(rng.random((4, 8, 3), dtype=np.float32))
assert np.array_equal(dl.Environment.from_mitsuba(picture).map, np.asarray(picture))
