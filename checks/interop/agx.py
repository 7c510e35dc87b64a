"""Prints what Blender's view transform AgX makes of 24 patches at three exposures: the table of tests/tone.rs.

Runs in interop's Python with `bpy` (`checks/interop/run` installs it), or in Blender: blender -b --python agx.py
"""

import pathlib
import tempfile

import bpy
import numpy as np

STOPS = [-4, 0, 3]
# The sRGB values that X-Rite publishes for the ColorChecker Classic (after November 2014).
PATCHES = """
115 82 68    194 150 130  98 122 157   87 108 67    133 128 177  103 189 170
214 126 44   80 91 166    193 90 99    94 60 108    157 188 64   224 163 46
56 61 150    70 148 73    175 54 60    231 199 31   187 86 149   8 133 161
243 243 242  200 200 200  160 160 160  122 122 121  85 85 85     52 52 52
"""


def main():
    encoded = np.array(PATCHES.split(), dtype=float).reshape(24, 3) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    shown = develop(np.concatenate([linear * 2.0**stops for stops in STOPS]))
    print(f"// Blender {bpy.app.version_string}")
    for stops, rows in zip(STOPS, shown.reshape(len(STOPS), 24, 3)):
        print(f"// {stops:+d} EV")
        print("".join(f"[{r}, {g}, {b}]," for r, g, b in rows))


def develop(rgb):
    """The sRGB values of 16 bits that Blender writes for linear Rec. 709."""
    scene = bpy.context.scene
    scene.display_settings.display_device = "sRGB"
    view = scene.view_settings
    view.view_transform, view.look, view.exposure, view.gamma = "AgX", "None", 0, 1
    scene.render.dither_intensity = 0
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "16"
    n = len(rgb)
    image = bpy.data.images.new("patches", n, 1, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels[:] = np.concatenate([rgb, np.ones((n, 1))], axis=1).astype(np.float32).ravel()
    with tempfile.TemporaryDirectory() as folder:
        path = str(pathlib.Path(folder, "patches.png"))
        image.save_render(path, scene=scene)
        written = bpy.data.images.load(path)
        written.colorspace_settings.name = "Non-Color"
        values = np.array(written.pixels[:]).reshape(n, 4)[:, :3]
    return np.round(values * 65535).astype(int)


main()
