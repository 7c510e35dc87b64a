"""`render` and `progressive`, with an optional progress bar."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from . import _domelight
from ._options import RENDER, takes
from ._progress import bar, callback

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._camera import Camera
    from ._domelight import Environment, Film, Progressive, Scene
    from ._options import RenderOptions
    from .strategies import Strategy

@takes(RENDER)
def render(
    scene: Scene,
    env: Environment | None = None,
    strategy: str | Strategy = "product",
    *,
    threads: int | None = None,
    camera: Camera | str | int | None = None,
    tile_size: int | None = None,
    time: float | None = None,
    progress: bool | Callable[[float], object] = False,
    display: bool | str = False,
    **options: Unpack[RenderOptions],
) -> Film:
    """Render a scene under an environment.

    Parameters
    ----------
    scene : Scene
        The scene.
    env : Environment, optional
        The light; by default the scene's own, otherwise the built-in sky.
    strategy : str or callable, default 'product'
        The sampling strategy: a text such as 'brdf:4', 'environment', 'mis:3:1', 'product:8', 'rejection:16',
        'sir:15/800', 'median-cut:64' or 'variance-minimization:64', or a function. A function receives the
        `ShadingPoints` of a tile and returns `(index, wi, weight)`: the points of the shadow rays (M,), their
        directions (M, 3) and their contributions if unoccluded (M, 3) or (M,), including 1 / n and 1 / pdf. Its
        attribute `n_rays`, 1 by default, is the maximum number of rays per point. It is called from several threads,
        one at a time.
    **options
    threads : int, optional
        By default the cores available to the process. The picture does not depend on it.
    camera : Camera, str or int, optional
        A camera, or the name or number of a camera in the file; by default the scene's own or one that frames the
        scene.
    tile_size : int, optional
        Pixels along a tile's edge; 16 by default, 64 for functions. Only 'product' depends on it.
    time : float, optional
        Stop after this many seconds of rendering; `film.complete` tells whether all samples were taken.
    progress : bool or callable, default False
        True shows a bar if tqdm is installed; a callable receives the finished fraction, in [0, 1], every hundredth of
        a second.
    display : bool or str, default False
        Show the picture while it is made in a viewer such as tev or HDRView that listens at this address, as
        'localhost:14158'. True is the address at which they listen by default, 127.0.0.1:14158.

    Returns
    -------
    Film
        Bit-identical to the program's for the same settings.

    Raises
    ------
    ValueError
        If a setting is invalid; the message names it.
    ConnectionError
        If no viewer listens at the address of `display`.
    RenderInterrupted
        A `KeyboardInterrupt` whose attribute `film` holds the samples so far.

    Warns
    -----
    DomelightWarning
        If samples were NaN or infinite, or the viewer went away.
    """
    shown = bar(progress, "render")
    report = shown or callback(progress)
    try:
        return _domelight.render(scene, env, strategy, options, threads, camera, tile_size, time, report, display)
    finally:
        if shown is not None:
            shown.close()


@takes(RENDER, passes="doubling")
def progressive(
    scene: Scene,
    env: Environment | None = None,
    strategy: str | Strategy = "product",
    *,
    threads: int | None = None,
    camera: Camera | str | int | None = None,
    tile_size: int | None = None,
    progress: bool | Callable[[float], object] = False,
    **options: Unpack[RenderOptions],
) -> Progressive:
    """Render pass by pass: an iterator over films with more and more samples.

    Parameters
    ----------
    scene, env, strategy, **options, threads, camera, tile_size
        As in `render`, but for the default of `passes`: films after 1, 2, 4, 8, … samples, with 'product' at least every
        64 samples. With 'efficient' and with `target_error`, there are films after the passes that suit the strategy best.
    progress : bool or callable, default False
        As in `render`; the fraction refers to all samples.

    Yields
    ------
    Film
        All samples so far; the last film is complete and bit-identical to that of `render` with the same `passes`.

    Raises
    ------
    RenderInterrupted
        A `KeyboardInterrupt` whose attribute `film` holds the samples so far; a later `next` continues from there.
    """
    report = bar(progress, "render") or callback(progress)
    return _domelight.progressive(scene, env, strategy, options, threads, camera, tile_size, report)
