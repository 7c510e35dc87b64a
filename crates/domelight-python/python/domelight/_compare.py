"""Compares strategies on one scene at equal samples, rays or time."""

from __future__ import annotations

import html
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _arguments, _domelight
from ._inspect import named
from ._options import PICTURE, takes
from ._progress import bar, callback

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._camera import Camera
    from ._domelight import Environment, Scene
    from ._options import PictureOptions
    from .strategies import Strategy


@dataclass(frozen=True, repr=False)
class Comparison:
    """The result of a comparison; a notebook displays its page.

    Attributes
    ----------
    report : dict
        All numbers, as in `domelight compare --json`.
    page : str
        A self-contained HTML page with pictures, errors and plots.
    reference : ndarray, shape (H, W, 3)
        The reference picture.
    pictures : dict of str to ndarray, shape (H, W, 3)
        The first seed's picture of each strategy that was not left out.
    errors : dict of str to ndarray, shape (H, W)
        The relative errors of the pictures.
    flip : dict of str to ndarray, shape (H, W)
        The FLIP maps of the pictures, in [0, 1].
    """

    report: dict[str, Any]
    page: str
    reference: npt.NDArray[np.float32]
    pictures: dict[str, npt.NDArray[np.float32]]
    errors: dict[str, npt.NDArray[np.float32]]
    flip: dict[str, npt.NDArray[np.float32]]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.page)

    def __repr__(self) -> str:
        height, width = self.reference.shape[:2]
        names = ", ".join(strategy["name"] for strategy in self.report["strategies"])
        return f"<Comparison {width} x {height}: {names}>"

    def __str__(self) -> str:
        lines = [f"{'strategy':24} {'spp':>6} {'rays':>8} {'CPU s':>8} {'relMSE':>10}"]
        for strategy in self.report["strategies"]:
            result = strategy["result"]
            if result is None:
                lines.append(f"{strategy['name']:24} left out: {strategy['left_out']}")
                continue
            rays, seconds, error = (
                result[key]["mean"] if isinstance(result[key], dict) else result[key]
                for key in ("rays", "cpu_seconds", "rel_mse")
            )
            lines.append(
                f"{strategy['name']:24} {result['spp']:6} {rays:8.1f} {seconds:8.3f} {error:10.2e}"
            )
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        # A frame isolates the page's styles.
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" style="width:100%;height:900px;border:0">'
            f"</iframe>"
        )


@takes(PICTURE, size=(256, 256))
def compare(
    scene: Scene,
    env: Environment | None = None,
    strategies: Sequence[str | Strategy] | Mapping[str, str | Strategy] = ("mis", "product"),
    *,
    budget: str = "rays:32",
    seeds: int = 4,
    reference_spp: int = 64,
    threads: int | None = None,
    camera: Camera | str | int | None = None,
    tile_size: int | None = None,
    progress: bool | Callable[[float, str], object] = False,
    **options: Unpack[PictureOptions],
) -> Comparison:
    """Compare strategies at equal samples, shadow rays or time.

    Parameters
    ----------
    scene : Scene
        The scene.
    env : Environment, optional
        The light; by default the scene's own.
    strategies : sequence or mapping
        Strategies as in `render`; a mapping names them. Functions are assumed to be unbiased.
    budget : str, default 'rays:32'
        The budget per picture: 'spp:16' camera samples per pixel, 'rays:64' shadow rays per pixel, or 'time:2s' of CPU.
    seeds : int, default 4
        The number of pictures per strategy.
    reference_spp : int, default 64
        Camera samples per pixel of the rendered reference.
    **options, threads, camera, tile_size
        As in `render`; the default tile size is 16, also for functions.
    progress : bool or callable, default False
        True shows a bar if tqdm is installed; a callable receives the finished fraction, in [0, 1], and the name of the
        current picture, every hundredth of a second.

    Returns
    -------
    Comparison

    Raises
    ------
    ValueError
        If a setting is invalid, or two strategies have the same name.

    Warns
    -----
    DomelightWarning
        If a strategy is left out or misses the budget, or the reference is too noisy.
    """
    shown = bar(progress, "compare")
    report = callback(progress) if shown is None else shown.labeled
    try:
        found = _domelight.compare(
            scene,
            env,
            named(strategies),
            budget,
            _arguments.whole("seeds", seeds, 1, 1000),
            _arguments.whole("reference_spp", reference_spp, 1, 1 << 24),
            options,
            threads,
            camera,
            tile_size,
            report,
        )
    finally:
        if shown is not None:
            shown.close()
    return Comparison(**found)
