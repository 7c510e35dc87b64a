"""`render`, with a progress bar where one is wanted."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from . import _domelight

if TYPE_CHECKING:
    from ._domelight import Camera, Environment, Film, Scene
    from .strategies import Strategy


def render(
    scene: Scene,
    env: Environment | None = None,
    strategy: str | Strategy = "product",
    *,
    spp: int = 32,
    size: tuple[int, int] = (640, 640),
    seed: int = 0,
    threads: int | None = None,
    camera: Camera | str | int | None = None,
    filter: str = "gaussian",
    sampler: str = "sobol",
    hide_env: bool = False,
    adaptive: bool = True,
    target_error: float | None = None,
    tile_size: int | None = None,
    passes: str = "efficient",
    progress: bool | Callable[[float], object] = False,
) -> Film:
    report: Callable[[float], object] | None
    bar: Any = None
    if progress is True:
        bar = _bar()
        report = None if bar is None else lambda share: bar.update(100.0 * share - bar.n)
    else:
        report = progress or None
    try:
        return _domelight._render(
            scene,
            env,
            strategy,
            spp=spp,
            size=size,
            seed=seed,
            threads=threads,
            camera=camera,
            filter=filter,
            sampler=sampler,
            hide_env=hide_env,
            adaptive=adaptive,
            target_error=target_error,
            tile_size=tile_size,
            passes=passes,
            progress=report,
        )
    finally:
        if bar is not None:
            bar.close()


def _bar() -> Any:
    """A progress bar, or None where the package tqdm is not installed."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm(total=100.0, unit="%", desc="render", bar_format="{l_bar}{bar}| {elapsed}<{remaining}")


render.__doc__ = (_domelight._render.__doc__ or "").replace(
    "progress : callable, optional\n    Called every hundredth of a second with the share that is done, in [0, 1].",
    "progress : bool or callable, default False\n    True shows a bar if tqdm is installed; a callable gets the share that "
    "is done, in [0, 1],\n    every hundredth of a second.",
)
