"""The engine. For the documentation of classes and functions, see `help(domelight.Environment)`, for instance."""

from collections.abc import Callable, Iterator
from os import PathLike
from typing import Any, SupportsIndex, TypeAlias, final

import numpy as np
import numpy.typing as npt

from ._camera import Camera
from ._names import Content, Curve, Engine, Ground, Layer, Layout, ShaderLanguage, Texels, Up, Window
from ._options import PictureOptions, RenderOptions
from .metrics import Comparison
from .strategies import Strategy
from .testing import Chi2Report

_Floats: TypeAlias = npt.NDArray[np.float32]
_Counts: TypeAlias = npt.NDArray[np.uint32]
_Path: TypeAlias = str | PathLike[str]
_MaterialLike: TypeAlias = Material | Bsdf | str

__version__: str

class DomelightWarning(UserWarning):
    """A picture or map lacks something, or was repaired."""

class RenderInterrupted(KeyboardInterrupt):
    """A render was interrupted; `film` holds the samples so far."""

    film: Film

@final
class Environment:
    def __new__(
        cls,
        map: npt.ArrayLike,
        *,
        rotation: float = 0.0,
        scale: float = 1.0,
        up: Up = "y",
        name: str = "array",
    ) -> Environment: ...
    @classmethod
    def load(
        cls,
        path: _Path,
        *,
        rotation: float = 0.0,
        scale: float = 1.0,
        exposure: float = 0.0,
        up: Up = "y",
        convention: str | None = None,
        mapping: str | None = None,
        faces: str | None = None,
        window: Window | None = None,
        layer: str | None = None,
        strict: bool = False,
    ) -> Environment: ...
    @classmethod
    def builtin(
        cls,
        name: str,
        *,
        rows: int = 1024,
        rotation: float = 0.0,
        scale: float = 1.0,
        exposure: float = 0.0,
        up: Up = "y",
    ) -> Environment: ...
    @classmethod
    def from_mitsuba(cls, source: Any) -> Environment: ...
    def to_mitsuba(self) -> dict[str, Any]: ...
    @property
    def map(self) -> _Floats: ...
    @property
    def solid_angles(self) -> npt.NDArray[np.float64]: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def rotation(self) -> float: ...
    @property
    def up(self) -> Up: ...
    @property
    def name(self) -> str: ...
    @property
    def power(self) -> float: ...
    def rotated(self, degrees: float) -> Environment: ...
    def scaled(self, factor: float) -> Environment: ...
    def sample(self, u: npt.ArrayLike) -> tuple[_Floats, _Floats, _Floats]: ...
    def radiance(self, wi: npt.ArrayLike) -> _Floats: ...
    def pdf(self, wi: npt.ArrayLike) -> _Floats: ...
    def directions(self, uv: npt.ArrayLike) -> _Floats: ...
    def uv(self, wi: npt.ArrayLike) -> _Floats: ...
    def shader_tables(self, *, texels: int = 524288, mis_compensation: bool = False) -> _Floats: ...
    def spherical_gaussians(self, n: int = 128, *, threads: int | None = None) -> _Floats: ...

@final
class Density:
    def __new__(cls, environment: Environment, weights: npt.ArrayLike) -> Density: ...
    def sample(self, u: npt.ArrayLike) -> tuple[_Floats, _Floats, _Floats]: ...
    def pdf(self, wi: npt.ArrayLike) -> _Floats: ...

@final
class Bsdf:
    @classmethod
    def parse(cls, text: str) -> Bsdf: ...
    def _repr_svg_(self) -> str: ...
    @classmethod
    def custom(
        cls,
        eval: Callable[[_Floats, _Floats], npt.ArrayLike],
        pdf: Callable[[_Floats, _Floats], npt.ArrayLike] | None = None,
        sample: Callable[[_Floats, _Floats], npt.ArrayLike] | None = None,
        *,
        albedo: npt.ArrayLike | None = None,
        max_eval: float | None = None,
        roughness: float | None = None,
    ) -> Bsdf: ...
    @property
    def albedo(self) -> _Floats: ...
    def eval(self, wo: npt.ArrayLike, wi: npt.ArrayLike) -> _Floats: ...
    def pdf(self, wo: npt.ArrayLike, wi: npt.ArrayLike) -> _Floats: ...
    def eval_pdf(self, wo: npt.ArrayLike, wi: npt.ArrayLike) -> tuple[_Floats, _Floats]: ...
    def sample(
        self, wo: npt.ArrayLike, u: npt.ArrayLike
    ) -> tuple[_Floats, _Floats, _Floats]: ...

@final
class Material:
    def __new__(cls, bsdf: _MaterialLike) -> Material: ...
    @classmethod
    def parse(cls, text: str) -> Material: ...
    def _repr_svg_(self) -> str: ...
    @property
    def bsdf(self) -> Bsdf: ...

@final
class Scene:
    def __new__(
        cls,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        normals: npt.ArrayLike | None = None,
        colors: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        material: _MaterialLike | None = None,
        ground: bool | Ground = False,
        normalize: bool = False,
        portal: str | None = None,
        up: Up = "y",
        name: str = "mesh",
    ) -> Scene: ...
    @classmethod
    def load(
        cls,
        path: _Path,
        *,
        material: _MaterialLike | None = None,
        ground: bool | Ground = False,
        normalize: bool = False,
        portal: str | None = None,
        scene: str | None = None,
        animation: str | None = None,
        at: float = 0.0,
        strict: bool = False,
        up: Up | None = None,
    ) -> Scene: ...
    @classmethod
    def builtin(
        cls,
        name: str,
        *,
        material: _MaterialLike | None = None,
        ground: bool | Ground = False,
        normalize: bool = False,
        portal: str | None = None,
    ) -> Scene: ...
    @property
    def name(self) -> str: ...
    @property
    def n_triangles(self) -> int: ...
    @property
    def bounds(self) -> _Floats | None: ...
    @property
    def offset(self) -> tuple[float, float, float]: ...
    @property
    def up(self) -> Up: ...
    @property
    def cameras(self) -> list[str]: ...
    def camera(self, aspect: float = 1.0) -> Camera: ...
    def environment(self, rows: int = 1024) -> Environment: ...

@final
class Film:
    @property
    def color(self) -> _Floats: ...
    @property
    def alpha(self) -> _Floats: ...
    def __getitem__(self, name: Layer, /) -> npt.NDArray[Any]: ...
    def __contains__(self, name: object, /) -> bool: ...
    def __iter__(self) -> Iterator[Layer]: ...
    @staticmethod
    def keys() -> list[Layer]: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def complete(self) -> bool: ...
    @property
    def strategy(self) -> str: ...
    @property
    def exposure(self) -> float: ...
    @property
    def camera_rays(self) -> int: ...
    @property
    def shading_points(self) -> int: ...
    @property
    def shadow_rays(self) -> int: ...
    @property
    def non_finite(self) -> int: ...
    def save(
        self,
        path: _Path,
        *,
        exposure: float | None = None,
        curve: Curve = "agx",
        bits: int = 8,
        denoise: bool = False,
    ) -> None: ...
    def denoise(self) -> _Floats: ...
    def to_png(
        self, *, exposure: float | None = None, curve: Curve = "agx", bits: int = 8
    ) -> bytes: ...
    def to_xarray(self) -> Any: ...
    def _repr_png_(self) -> bytes: ...

@final
class Progressive:
    def __iter__(self) -> Progressive: ...
    def __next__(self) -> Film: ...
    @property
    def film(self) -> Film | None: ...

@final
class ShadingPoints:
    def __len__(self) -> int: ...
    @property
    def position(self) -> _Floats: ...
    @property
    def normal(self) -> _Floats: ...
    @property
    def geometric_normal(self) -> _Floats: ...
    @property
    def wo(self) -> _Floats: ...
    @property
    def albedo(self) -> _Floats: ...
    def random(self, n: SupportsIndex = 1, purpose: str = "environment") -> _Floats: ...
    def eval(self, wi: npt.ArrayLike, index: npt.ArrayLike | None = None) -> _Floats: ...
    def eval_pdf(
        self, wi: npt.ArrayLike, index: npt.ArrayLike | None = None
    ) -> tuple[_Floats, _Floats]: ...
    def sample(
        self, u: npt.ArrayLike, index: npt.ArrayLike | None = None
    ) -> tuple[_Floats, _Floats, _Floats]: ...

@final
class PrefilteredLight:
    @property
    def layout(self) -> Layout: ...
    @property
    def levels(self) -> list[_Floats]: ...
    @property
    def roughness(self) -> list[float]: ...
    @property
    def irradiance(self) -> _Floats: ...
    @property
    def harmonics(self) -> _Floats: ...
    @property
    def harmonics_window(self) -> float: ...
    @property
    def axes(self) -> _Floats: ...
    @property
    def sun(self) -> Rig | None: ...
    def brdf(self, size: int = 128) -> _Floats: ...
    def save(
        self, path: _Path, content: Content = "radiance", *, texels: Texels = "rgb9e5"
    ) -> None: ...

@final
class Rig:
    def __len__(self) -> int: ...
    @property
    def directions(self) -> _Floats: ...
    @property
    def irradiance(self) -> _Floats: ...
    @property
    def angular_radius(self) -> _Floats: ...
    @property
    def share(self) -> _Floats: ...
    @property
    def solid_angle(self) -> _Floats: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def labels(self) -> _Counts: ...
    @property
    def residual(self) -> Environment | None: ...
    def shading_error(self, environment: Environment) -> dict[str, float]: ...
    def save(self, path: _Path, *, format: str | None = None) -> None: ...
    def _repr_png_(self) -> bytes: ...

def job_options() -> str: ...
def render(
    scene: Scene,
    env: Environment | None,
    strategy: str | Strategy,
    options: RenderOptions,
    threads: int | None,
    camera: Camera | str | int | None,
    tile_size: int | None,
    time: float | None,
    progress: Callable[[float], object] | None,
    display: bool | str,
) -> Film: ...
def progressive(
    scene: Scene,
    env: Environment | None,
    strategy: str | Strategy,
    options: RenderOptions,
    threads: int | None,
    camera: Camera | str | int | None,
    tile_size: int | None,
    progress: Callable[[float], object] | None,
) -> Progressive: ...
def compare(
    scene: Scene,
    env: Environment | None,
    strategies: list[tuple[str, str | Strategy]],
    budget: str,
    seeds: int,
    reference_spp: int,
    options: PictureOptions,
    threads: int | None,
    camera: Camera | str | int | None,
    tile_size: int | None,
    progress: Callable[[float, str], object] | None,
) -> dict[str, Any]: ...
def inspect(
    scene: Scene,
    env: Environment | None,
    strategies: list[tuple[str, str | Strategy]],
    pixel: tuple[int, int],
    options: PictureOptions,
    threads: int | None,
    camera: Camera | str | int | None,
    resolution: int,
) -> dict[str, Any]: ...
def lights(
    env: Environment,
    n: int | None = 64,
    *,
    method: str = "variance-minimization",
    sun: bool = False,
    lamps: int = 0,
    min_share: float | None = None,
    threads: int | None = None,
) -> Rig: ...
def prefilter(
    env: Environment,
    size: int = 256,
    *,
    engine: Engine | None = None,
    sun: str = "keep",
    layout: Layout = "cube",
    sh_window: bool = True,
    threads: int | None = None,
) -> PrefilteredLight: ...
def read(path: _Path, *, layer: str | None = None) -> _Floats: ...
def write(
    path: _Path,
    picture: npt.ArrayLike,
    *,
    exposure: float | None = None,
    curve: Curve = "agx",
    bits: int = 8,
) -> None: ...
def tone_map(
    picture: npt.ArrayLike, *, exposure: float | None = None, curve: Curve = "agx"
) -> _Floats: ...
def shader_code(language: ShaderLanguage) -> str: ...
def strategy_names() -> list[tuple[str, str]]: ...
def compare_pictures(
    test: npt.ArrayLike, reference: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> Comparison: ...
def error_map(test: npt.ArrayLike, reference: npt.ArrayLike, relative: bool) -> _Floats: ...
def flip(
    test: npt.ArrayLike, reference: npt.ArrayLike, pixels_per_degree: float | None = None
) -> _Floats: ...
def hdr_flip(
    test: npt.ArrayLike, reference: npt.ArrayLike, pixels_per_degree: float | None = None
) -> _Floats: ...
def chi2(
    name: str,
    sample: Callable[[_Floats], npt.ArrayLike],
    pdf: Callable[[_Floats], npt.ArrayLike],
    samples: int,
    cells: tuple[int, int],
    axis: npt.ArrayLike,
    seed: int,
    tests: int,
    significance: float,
) -> Chi2Report: ...
def z_test(
    name: str,
    batches: npt.NDArray[np.float64],
    reference: list[float],
    standard_error: list[float],
    tests: int,
    significance: float,
    rounding: float,
) -> float: ...
