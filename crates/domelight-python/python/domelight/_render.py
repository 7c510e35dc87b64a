"""`render` and `progressive`, with an optional progress bar."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from . import _arguments, _domelight
from ._progress import bar, callback

if TYPE_CHECKING:
    from ._domelight import Camera, Environment, Film, Progressive, Scene
    from ._names import Filter, Passes, Sampler
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
    filter: Filter = "gaussian",
    sampler: Sampler = "sobol",
    hide_env: bool = False,
    adaptive: bool = True,
    target_error: float | None = None,
    tile_size: int | None = None,
    passes: Passes = "efficient",
    time: float | None = None,
    progress: bool | Callable[[float], object] = False,
) -> Film:
    shown = bar(progress, "render")
    try:
        return _domelight._render(
            scene,
            env,
            strategy,
            spp=_arguments.spp(spp),
            size=_arguments.size(size),
            seed=_arguments.seed(seed),
            threads=threads,
            camera=camera,
            filter=filter,
            sampler=sampler,
            hide_env=hide_env,
            adaptive=adaptive,
            target_error=target_error,
            tile_size=tile_size,
            passes=passes,
            time=time,
            progress=shown or callback(progress),
        )
    finally:
        if shown is not None:
            shown.close()


def progressive(
    scene: Scene,
    env: Environment | None = None,
    strategy: str | Strategy = "product",
    *,
    spp: int = 32,
    size: tuple[int, int] = (640, 640),
    seed: int = 0,
    threads: int | None = None,
    camera: Camera | str | int | None = None,
    filter: Filter = "gaussian",
    sampler: Sampler = "sobol",
    hide_env: bool = False,
    adaptive: bool = True,
    target_error: float | None = None,
    tile_size: int | None = None,
    passes: Passes = "doubling",
    progress: bool | Callable[[float], object] = False,
) -> Progressive:
    return _domelight._progressive(
        scene,
        env,
        strategy,
        spp=_arguments.spp(spp),
        size=_arguments.size(size),
        seed=_arguments.seed(seed),
        threads=threads,
        camera=camera,
        filter=filter,
        sampler=sampler,
        hide_env=hide_env,
        adaptive=adaptive,
        target_error=target_error,
        tile_size=tile_size,
        passes=passes,
        progress=bar(progress, "render") or callback(progress),
    )


render.__doc__ = _domelight._render.__doc__
progressive.__doc__ = _domelight._progressive.__doc__
