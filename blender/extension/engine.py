# SPDX-FileCopyrightText: 2026 The domelight developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine domelight: final renders by direct light."""

import tempfile
import warnings

import bpy
import domelight as dl
import numpy as np

from . import scene as scenes
from .camera import camera
from .failure import Unsupported
from .notes import Notes

# Passes of the engine's own: the switch, its name in Blender, the channels, and the layer of a film.
OWN_PASSES = (
    ("use_pass_albedo", "Albedo", "RGB", "albedo"),
    ("use_pass_unoccluded", "Unoccluded", "RGB", "unoccluded"),
    ("use_pass_variance", "Variance", "RGB", "variance"),
)

# What Blender's own renderers write where the camera sees no surface.
NO_DEPTH = 1e10


class Canceled(Exception):
    """The user ended the render."""


class RenderSettings(bpy.types.PropertyGroup):
    """Settings of the engine."""

    samples: bpy.props.IntProperty(
        name="Samples", default=32, min=1, max=1 << 20, description="Camera samples per pixel, on average"
    )
    seed: bpy.props.IntProperty(name="Seed", default=0, min=0, description="Seed of the random numbers")
    adaptive: bpy.props.BoolProperty(name="Adaptive", default=True, description="Take more samples in noisier pixels")
    filter: bpy.props.EnumProperty(
        name="Pixel Filter",
        default="blackman-harris",
        items=[(name, name.replace("-", " ").title(), "") for name in ("box", "tent", "gaussian", "blackman-harris")],
        description="The filter over the samples around a pixel",
    )
    use_pass_albedo: bpy.props.BoolProperty(name="Albedo", description="The reflectance of what the camera sees")
    use_pass_unoccluded: bpy.props.BoolProperty(name="Unoccluded", description="The picture without shadows")
    use_pass_variance: bpy.props.BoolProperty(name="Variance", description="The squared error of each pixel, estimated")


class DomelightRenderEngine(bpy.types.RenderEngine):
    """Direct light from the world's HDRI"""

    bl_idname = "DOMELIGHT"
    bl_label = "domelight"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True

    def update_render_passes(self, scene=None, renderlayer=None):
        """List the passes for the compositor."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        if renderlayer.use_pass_z:
            self.register_pass(scene, renderlayer, "Depth", 1, "Z", "VALUE")
        if renderlayer.use_pass_normal:
            self.register_pass(scene, renderlayer, "Normal", 3, "XYZ", "VECTOR")
        for switch, name, channels, _ in OWN_PASSES:
            if getattr(scene.domelight, switch):
                self.register_pass(scene, renderlayer, name, 3, channels, "COLOR")

    def render(self, depsgraph):
        """Render one view layer."""
        notes = Notes()
        try:
            with warnings.catch_warnings(record=True) as caught, tempfile.TemporaryDirectory() as folder:
                warnings.simplefilter("always", dl.DomelightWarning)
                self.render_layer(depsgraph, folder, notes)
        except Canceled:
            return
        except (Unsupported, ValueError, MemoryError) as error:
            # Blender ends the render with this sentence.
            self.error_set(str(error))
            self.report({"ERROR"}, str(error))
            return
        said = [notes.text(), *(f"{warning.message}" for warning in caught if warning.category is dl.DomelightWarning)]
        said = " ".join(filter(None, said))
        if said:
            self.report({"WARNING"}, said)
        self.update_stats("", said)

    def render_layer(self, depsgraph, folder, notes):
        """Read the scene, render it, and show the picture after each pass."""
        scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
        if scene.camera is None:
            raise Unsupported("The scene has no camera.")
        self.update_stats("", "Reading the scene")
        environment, turn = scenes.environment(scene.world)
        file = scenes.export(depsgraph, folder, turn, notes)
        built = dl.Scene.load(file) if file else dl.Scene(np.zeros((1, 3)), np.zeros((0, 3), int))
        note_settings(scene, notes)
        region, size = picture(scene.render)
        # Blender 5.0 crashes where it writes a render that was ended before it had a result.
        self.end_result(self.begin_result(0, 0, *size, layer=layer.name))
        eye = scene.camera.evaluated_get(depsgraph)
        settings = scene.domelight
        self.update_stats("", f"{built.n_triangles} triangles")
        films = dl.progressive(
            built,
            environment,
            spp=settings.samples,
            size=size,
            seed=settings.seed,
            camera=camera(eye, depsgraph, scene.render, region, turn, notes),
            filter=settings.filter,
            hide_env=scene.render.film_transparent,
            adaptive=settings.adaptive,
            threads=scene.render.threads if scene.render.threads_mode == "FIXED" else None,
            progress=self.progress,
        )
        own = [entry for entry in OWN_PASSES if getattr(settings, entry[0])]
        for _, name, channels, _ in own:
            self.add_pass(name, 3, channels, layer=layer.name)
        for film in films:
            self.show(film, layer, own, turn)

    def progress(self, share):
        """Show the progress, and end the render if the user asks for it."""
        self.update_progress(share)
        if is_canceled(self):
            raise Canceled

    def show(self, film, layer, own, turn):
        """Hand a film over to Blender."""
        height, width = film.shape
        pictures = {"Combined": np.concatenate([film.color, film.alpha.reshape(height, width, 1)], axis=2)}
        if layer.use_pass_z:
            pictures["Depth"] = depth(film)
        if layer.use_pass_normal:
            # Back from the frame of the map.
            pictures["Normal"] = film["normal"] @ turn.astype(np.float32)
        for _, name, _, source in own:
            pictures[name] = film[source]
        result = self.begin_result(0, 0, width, height, layer=layer.name)
        for name, values in pictures.items():
            hand_over(result, name, values)
        self.end_result(result)


def hand_over(result, name, values):
    """Write a picture with its top row first into a pass, whose bottom row is first."""
    result.layers[0].passes[name].rect.foreach_set(np.ascontiguousarray(values[::-1], np.float32).ravel())


def is_canceled(engine):
    """Whether the user has ended the render."""
    return engine.test_break()


def depth(film):
    """The depth of what the camera sees."""
    values = film["depth"].reshape(*film.shape, 1)
    return np.where(film["hits"].reshape(*film.shape, 1) > 0, values, NO_DEPTH)


def picture(settings):
    """The region of the picture that is rendered, as fractions (x0, x1, y0, y1), bottom up, and its size in pixels."""
    # As Blender rounds them: sizes in integers, borders in single precision.
    width, height = (n * settings.resolution_percentage // 100 for n in (settings.resolution_x, settings.resolution_y))
    if not settings.use_border:
        return (0, 1, 0, 1), (width, height)
    x0, x1 = (int(np.float32(x) * np.float32(width)) for x in (settings.border_min_x, settings.border_max_x))
    y0, y1 = (int(np.float32(y) * np.float32(height)) for y in (settings.border_min_y, settings.border_max_y))
    return (x0 / width, x1 / width, y0 / height, y1 / height), (max(x1 - x0, 1), max(y1 - y0, 1))


def note_settings(scene, notes):
    """Note settings of the scene that are not covered."""
    if scene.render.use_motion_blur:
        notes.add("motion blur", scene.name)
    if scene.render.use_multiview:
        notes.add("stereo", scene.name)


class RENDER_PT_domelight(bpy.types.Panel):
    """The panel in the Render properties"""

    bl_label = "Sampling"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {"DOMELIGHT"}

    @classmethod
    def poll(cls, context):
        return context.engine == "DOMELIGHT"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        settings = context.scene.domelight
        for name in ("samples", "adaptive", "seed", "filter"):
            layout.prop(settings, name)
        layout.prop(context.scene.render, "film_transparent")
        layout.label(text="Passes")
        for switch, *_ in OWN_PASSES:
            layout.prop(settings, switch)


CLASSES = (RenderSettings, DomelightRenderEngine, RENDER_PT_domelight)

# Panels of Blender that the engine does not need.
NOT_SHOWN = {"RENDER_PT_simplify", "RENDER_PT_freestyle", "VIEWLAYER_PT_freestyle", "RENDER_PT_eevee_sampling"}


# EEVEE's panels for the nodes of worlds and materials.
NODES = {"EEVEE_WORLD_PT_surface", "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface"}


def shared_panels():
    """Blender's panels that suit the engine."""
    panels = [cls for name in dir(bpy.types) if hasattr(cls := getattr(bpy.types, name), "COMPAT_ENGINES")]
    is_shared = lambda cls: "BLENDER_RENDER" in cls.COMPAT_ENGINES and cls.__name__ not in NOT_SHOWN
    return [cls for cls in panels if is_shared(cls) or cls.__name__ in NODES]


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.domelight = bpy.props.PointerProperty(type=RenderSettings)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(DomelightRenderEngine.bl_idname)


def unregister():
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(DomelightRenderEngine.bl_idname)
    del bpy.types.Scene.domelight
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
