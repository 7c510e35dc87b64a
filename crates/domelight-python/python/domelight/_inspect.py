"""The pixel X-ray: why a pixel is noisy, and how to reduce the noise."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _arguments, _domelight
from ._options import PICTURE, takes

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._camera import Camera
    from ._domelight import Environment, Scene
    from ._options import PictureOptions
    from .strategies import Strategy


SHOWN = 8
"""The number of causes that a figure distinguishes."""


@dataclass(frozen=True)
class Decomposition:
    """The variance of a strategy at a pixel, by cause, in units of luminance.

    Attributes
    ----------
    name : str
        The strategy.
    unbiased : bool
        Whether the strategy is unbiased; otherwise its variance is not its error. True for functions.
    mean : float
        Luminance of the pixel.
    variance : float
        Variance of the estimate from one camera sample.
    variance_per_ray : float
        Variance of the estimate from one shadow ray.
    rays_per_sample : float
        Shadow rays per camera sample.
    between_samples : float
        Fraction of the variance that no choice of directions changes.
    shares : dict of str to float
        Causes and their shares, the largest first; they sum to 1, and negative shares offset others.
    diagnosis : str
        Why the pixel is noisy, in one sentence.
    density : ndarray, shape (R, R), or None
        Counted density of the strategy's rays [sr^-1], on the hemisphere's disk.
    """

    name: str
    unbiased: bool
    mean: float
    variance: float
    variance_per_ray: float
    rays_per_sample: float
    between_samples: float
    shares: dict[str, float]
    diagnosis: str
    density: npt.NDArray[np.float32] | None


@dataclass(frozen=True, repr=False)
class Inspection:
    """The X-ray of a pixel; a notebook shows it as a figure if matplotlib is installed.

    Maps are disks in the equal-area projection of the hemisphere: the shading normal is at the center, the horizon on the
    circle, and the upper side of the surface at the top; of a surface that is nearly horizontal, the side away from the
    viewer.

    Attributes
    ----------
    pixel : (int, int)
        Column and row, from the upper left.
    coverage : float
        Fraction of the camera samples that hit the scene.
    position, normal, albedo : ndarray, shape (3,), or None
        The hit nearest to the pixel's center.
    frame : ndarray, shape (3, 3), or None
        The axes of the maps in world space, by rows: to the right, to the top, and the shading normal.
    maps : dict of str to ndarray
        'radiance', 'bsdf_cos', 'product' (R, R, 3) and 'visibility' (R, R); empty without a hit.
    strategies : list of Decomposition
        The strategies, in the requested order.
    advice : str
        Advice, in one sentence.
    """

    pixel: tuple[int, int]
    coverage: float
    position: npt.NDArray[np.float32] | None
    normal: npt.NDArray[np.float32] | None
    albedo: npt.NDArray[np.float32] | None
    frame: npt.NDArray[np.float32] | None
    maps: dict[str, npt.NDArray[np.float32]]
    strategies: list[Decomposition]
    advice: str

    def __repr__(self) -> str:
        names = ", ".join(s.name for s in self.strategies)
        return f"<Inspection of pixel {self.pixel[0]}, {self.pixel[1]}: {names}>"

    def __str__(self) -> str:
        lines = [f"pixel {self.pixel[0]}, {self.pixel[1]}"]
        lines += [f"{s.name}: {s.diagnosis}" for s in self.strategies]
        return "\n".join([*lines, self.advice])

    def figure(self) -> Any:
        """The maps and the causes as a matplotlib figure."""
        from matplotlib.figure import Figure

        panels: list[tuple[str, npt.NDArray[np.float32]]] = []
        for name, title in [("radiance", "L"), ("bsdf_cos", "f cos"), ("visibility", "V"), ("product", "f cos L V")]:
            if name in self.maps:
                panels.append((title, self.maps[name]))
        panels += [(s.name, s.density) for s in self.strategies if s.density is not None]
        columns = max(4, len(panels))
        figure = Figure(figsize=(2.2 * columns, 5.5), layout="constrained")
        grid = figure.add_gridspec(2, columns)
        for i, (title, values) in enumerate(panels):
            axes = figure.add_subplot(grid[0, i])
            if values.ndim == 3:
                axes.imshow(_domelight.tone_map(values))
            else:
                axes.imshow(values, vmin=0, vmax=float(np.quantile(values, 0.995)) or 1.0, cmap="magma")
            axes.set_title(title, fontsize=9)
            axes.axis("off")
        axes = figure.add_subplot(grid[1, :])
        variances = np.array([s.variance_per_ray for s in self.strategies])
        bars = {
            cause: variances * [s.shares.get(cause, 0.0) for s in self.strategies]
            for cause in dict.fromkeys(cause for s in self.strategies for cause in s.shares)
        }
        greatest = sorted(bars, key=lambda cause: -float(np.max(bars[cause])))
        left = np.zeros(len(self.strategies))
        names = [s.name for s in self.strategies]
        for cause in greatest[:SHOWN]:
            axes.barh(names, bars[cause], left=left, label=cause)
            left += bars[cause]
        if greatest[SHOWN:]:
            others = np.sum([bars[cause] for cause in greatest[SHOWN:]], axis=0)
            axes.barh(names, others, left=left, label="others", color="lightgray")
        axes.set_xlabel("variance per shadow ray, by cause")
        axes.invert_yaxis()
        if greatest:
            axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1))
        axes.set_title(self.advice, fontsize=9)
        return figure

    def _repr_png_(self) -> bytes | None:
        try:
            figure = self.figure()
        except ImportError:
            return None
        out = io.BytesIO()
        figure.savefig(out, format="png")
        return out.getvalue()


def named(
    strategies: Sequence[str | Strategy] | Mapping[str, str | Strategy],
) -> list[tuple[str, str | Strategy]]:
    """Strategies with their names: their texts, or the names of functions."""
    if isinstance(strategies, Mapping):
        return list(strategies.items())
    if isinstance(strategies, str) or not isinstance(strategies, Iterable):
        raise ValueError(f"strategies is {strategies!r}; it must be a list, such as [{strategies!r}], or a dictionary")
    return [
        (s if isinstance(s, str) else getattr(s, "__name__", type(s).__name__), s)
        for s in strategies
    ]


@takes(PICTURE)
def inspect(
    scene: Scene,
    env: Environment | None = None,
    *,
    pixel: tuple[int, int],
    strategies: Sequence[str | Strategy] | Mapping[str, str | Strategy] = ("brdf", "environment", "mis", "product"),
    threads: int | None = None,
    camera: Camera | str | int | None = None,
    resolution: int = 64,
    **options: Unpack[PictureOptions],
) -> Inspection:
    """Explain why a pixel is noisy, and how to reduce the noise.

    Parameters
    ----------
    scene : Scene
        The scene.
    env : Environment, optional
        The light; by default the scene's own.
    pixel : (int, int)
        Column and row in a picture of `size`, from the upper left.
    strategies : sequence or mapping
        Strategies as in `render`; a mapping names them.
    **options, threads, camera
        As in `render`.
    resolution : int, default 64
        Pixels along the edge of a map.

    Returns
    -------
    Inspection

    Raises
    ------
    ValueError
        If the pixel is not in the picture, or a setting is invalid.
    """
    found = _domelight.inspect(
        scene,
        env,
        named(strategies),
        _arguments.pair("pixel", pixel, "column, row"),
        options,
        threads,
        camera,
        resolution,
    )
    found["strategies"] = [Decomposition(**s) for s in found["strategies"]]
    return Inspection(**found)
