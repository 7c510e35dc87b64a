"""Direct illumination under measured light.

A scene that is lit by an HDR environment is rendered by evaluating the integral of f_r cos(theta) L V over directions at
every visible point, with every sampling strategy of the field, or one written in Python.

>>> import domelight as dl
>>> scene = dl.Scene.builtin("sphere")
>>> env = dl.Environment.builtin("studio", rows=64)
>>> film = dl.render(scene, env, strategy="product", spp=4, size=(64, 64))
>>> film.color.shape
(64, 64, 3)

Conventions
-----------
Arrays are float32 and C-contiguous; anything array-like is taken, without a copy where it is that. `wo` points toward the
viewer and `wi` toward the light, both unit vectors away from the surface. Values of reflectance are f_r * cos(theta_i),
the cosine inside; densities are per solid angle [sr^-1]; radiance is in W m^-2 sr^-1, linear Rec. 709. The world is
right-handed, +Y up. Pictures have their top row first. Uniform numbers lie in [0, 1).

Wrong input is a `ValueError` that names the argument, its shape or value, and what it must be. What a picture or a map
lacks is a `DomelightWarning`.
"""

from . import metrics, strategies, testing
from ._domelight import (
    Bsdf,
    Camera,
    Density,
    DomelightWarning,
    Environment,
    Film,
    Material,
    Progressive,
    RenderInterrupted,
    Rig,
    Scene,
    ShadingPoints,
    __version__,
    lights,
    read,
    strategy_names,
    tone_map,
    write,
)
from ._compare import Comparison, compare
from ._inspect import Inspection, inspect
from ._render import progressive, render

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
    "progressive",
    "read",
    "render",
    "strategies",
    "strategy_names",
    "testing",
    "tone_map",
    "write",
]
