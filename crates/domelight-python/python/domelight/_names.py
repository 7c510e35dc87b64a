"""The names that arguments accept, for type checkers."""

from typing import Literal, TypeAlias

Filter: TypeAlias = Literal["box", "tent", "gaussian", "blackman-harris"]
Sampler: TypeAlias = Literal["sobol", "independent"]
Passes: TypeAlias = Literal["efficient", "doubling"]
Curve: TypeAlias = Literal["standard", "reinhard", "aces", "agx", "neutral"]
Layer: TypeAlias = Literal[
    "color", "alpha", "unoccluded", "shadow", "albedo", "normal", "depth", "variance", "samples", "hits"
]
Ground: TypeAlias = Literal["plate", "shadow"]
Up: TypeAlias = Literal["y", "z"]
Window: TypeAlias = Literal["data", "display"]
ShaderLanguage: TypeAlias = Literal["wgsl", "glsl", "hlsl", "slang", "cuda", "metal"]
Layout: TypeAlias = Literal["cube", "octahedral"]
Engine: TypeAlias = Literal["three", "filament", "babylon", "godot", "bevy", "unreal", "playcanvas"]
Content: TypeAlias = Literal["radiance", "irradiance", "brdf"]
Texels: TypeAlias = Literal["rgb9e5", "half"]
