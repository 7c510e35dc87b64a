"""Direct illumination under measured light.

Renders scenes under an HDR environment by integrating f_r cos(theta) L V over directions at every visible point, with
any built-in sampling strategy or one written in Python.

>>> import domelight as dl
>>> scene = dl.Scene.builtin("sphere")
>>> env = dl.Environment.builtin("studio", rows=64)
>>> film = dl.render(scene, env, strategy="product", spp=4, size=(64, 64))
>>> film.color.shape
(64, 64, 3)

Conventions
-----------
Arrays are float32 and C-contiguous; functions accept anything array-like, and copy it only if it is not. `wo` points
toward the viewer and `wi` toward the light, both unit vectors away from the surface. Reflectance values are
f_r * cos(theta_i), including the cosine; densities are per solid angle [sr^-1]; radiance is in W m^-2 sr^-1, linear
Rec. 709. The world is right-handed, +Y up. Pictures have their top row first. Uniform numbers are in [0, 1).

Invalid input raises a `ValueError` that names the argument, its shape or value, and the requirement. Missing or repaired
parts of a picture or map give a `DomelightWarning`.
"""

from . import metrics, strategies, testing
from ._domelight import (
    Bsdf,
    Density,
    DomelightWarning,
    Environment,
    Film,
    Material,
    PrefilteredLight,
    Progressive,
    RenderInterrupted,
    Rig,
    Scene,
    ShadingPoints,
    __version__,
    lights,
    prefilter,
    read,
    shader_code,
    strategy_names,
    tone_map,
    write,
)
from ._camera import Camera
from ._compare import Comparison, compare
from ._inspect import Inspection, inspect
from ._render import progressive, render
from .strategies import strategy

__all__ = [
    "Bsdf",
    "Camera",
    "Comparison",
    "Density",
    "DomelightWarning",
    "Environment",
    "Film",
    "Inspection",
    "Material",
    "PrefilteredLight",
    "Progressive",
    "RenderInterrupted",
    "Rig",
    "Scene",
    "ShadingPoints",
    "__version__",
    "compare",
    "inspect",
    "lights",
    "metrics",
    "prefilter",
    "progressive",
    "read",
    "render",
    "shader_code",
    "strategies",
    "strategy",
    "strategy_names",
    "testing",
    "tone_map",
    "write",
]
