"""Strategies written in Python, to use, read and modify.

A strategy is a function of the `ShadingPoints` of a tile. It returns `(index, wi, weight)`: the points of the shadow
rays, their directions, and their contributions if unoccluded. The estimate at a point is the sum of weight * V(wi) over
its rays, so the weight includes 1 / n, 1 / pdf and combination weights. The attribute `n_rays` is the maximum number of
rays per point.

>>> import domelight as dl
>>> env = dl.Environment.builtin("studio", rows=64)
>>> strategy = dl.strategies.Environment(env, n=2)
>>> film = dl.render(dl.Scene.builtin("sphere"), env, strategy, spp=2, size=(32, 32))
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from ._domelight import Density, Environment as Map, ShadingPoints

__all__ = ["Brdf", "Cosine", "Environment", "Mis", "Rays", "Strategy"]

Rays: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]
"""Indices of points (M,), directions (M, 3) and weights (M, 3) or (M,)."""

Strategy: TypeAlias = "Callable[[ShadingPoints], Rays]"
"""A function that generates shadow rays for the points of a tile."""


_Function = TypeVar("_Function", bound="Strategy")


def strategy(*, n_rays: int) -> Callable[[_Function], _Function]:
    """Declare the maximum number of rays per point of a function, as its attribute `n_rays`.

    Parameters
    ----------
    n_rays : int
        At least 1.

    Examples
    --------
    >>> import domelight as dl
    >>> @dl.strategy(n_rays=2)
    ... def two_rays(points):
    ...     return dl.strategies.Brdf(env, n=2)(points)
    """
    if isinstance(n_rays, bool) or not isinstance(n_rays, int) or n_rays < 1:
        raise ValueError(f"n_rays is {n_rays!r}; it must be a whole number of at least 1")

    def declare(function: _Function) -> _Function:
        if not callable(function):
            raise ValueError(f"strategy(n_rays={n_rays}) is given {function!r}, not a function")
        function.n_rays = n_rays  # type: ignore[attr-defined]
        return function

    return declare


class _Sampler(Protocol):
    """A sampler of directions toward the light: an environment or a density."""

    def sample(self, u: npt.ArrayLike) -> tuple[Any, Any, Any]: ...

    def pdf(self, wi: npt.ArrayLike) -> Any: ...


def _flat(wi: npt.NDArray[np.float32], weight: npt.NDArray[np.float32]) -> Rays:
    """The rays of arrays with n rows per point."""
    points, n = wi.shape[:2]
    index = np.repeat(np.arange(points, dtype=np.int64), n)
    return index, wi.reshape(-1, 3), weight.reshape(-1, 3)


def _over(value: npt.NDArray[np.float32], pdf: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """value / pdf, and 0 where there is no sample."""
    out = np.zeros_like(value)
    np.divide(value, pdf[..., np.newaxis], out=out, where=pdf[..., np.newaxis] > 0)
    return out


class Environment:
    """Samples directions from the environment, or from a density over it.

    With the environment's own density, the result is bit-identical to that of the built-in 'environment'.

    Parameters
    ----------
    env : Environment
        The light.
    n : int, default 1
        Rays of each point.
    density : Density, optional
        The density of directions; by default proportional to luminance. It must be positive wherever there is light.
    """

    def __init__(self, env: Map, n: int = 1, density: Density | None = None) -> None:
        self.n_rays = n
        self._light: _Sampler = env if density is None else density

    def __call__(self, points: ShadingPoints) -> Rays:
        n = self.n_rays
        u = points.random(n, "environment")
        wi, radiance, pdf = self._light.sample(u[..., :2])
        weight = _over(points.eval(wi) * radiance, pdf * np.float32(n))
        return _flat(wi, weight)


class Brdf:
    """Samples directions from the BSDF.

    Parameters
    ----------
    env : Environment
        The light.
    n : int, default 1
        Rays of each point.
    """

    def __init__(self, env: Map, n: int = 1) -> None:
        self.n_rays = n
        self._env = env

    def __call__(self, points: ShadingPoints) -> Rays:
        n = self.n_rays
        wi, value, pdf = points.sample(points.random(n, "brdf"))
        weight = _over(value * self._env.radiance(wi), pdf * np.float32(n))
        return _flat(wi, weight)


class Cosine:
    """Samples directions in proportion to the cosine to the shading normal: the simplest strategy.

    Parameters
    ----------
    env : Environment
        The light.
    n : int, default 1
        Rays of each point.
    """

    def __init__(self, env: Map, n: int = 1) -> None:
        self.n_rays = n
        self._env = env

    def __call__(self, points: ShadingPoints) -> Rays:
        u = points.random(self.n_rays, "brdf")
        r, phi = np.sqrt(u[..., 0]), np.float32(2 * np.pi) * u[..., 1]
        z = np.sqrt(np.float32(1) - u[..., 0])
        normal = points.normal[:, np.newaxis, :]
        tangent = _perpendicular(normal)
        bitangent = np.cross(normal, tangent)
        wi = (
            (r * np.cos(phi))[..., np.newaxis] * tangent
            + (r * np.sin(phi))[..., np.newaxis] * bitangent
            + z[..., np.newaxis] * normal
        ).astype(np.float32)
        pdf = (self.n_rays * z / np.pi).astype(np.float32)
        weight = _over(points.eval(wi) * self._env.radiance(wi), pdf)
        return _flat(wi, weight)


def _perpendicular(normal: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """A unit vector perpendicular to each normal."""
    axis = np.where(np.abs(normal[..., :1]) < 0.5, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    across = np.cross(normal, axis)
    unit: npt.NDArray[np.float32] = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return unit.astype(np.float32)


class Mis:
    """Samples directions from the light and from the BSDF, weighted by the power heuristic.

    Parameters
    ----------
    env : Environment
        The light.
    n_light, n_brdf : int, default 1
        Rays per point from the light and from the BSDF.
    density : Density, optional
        The density of the light's directions; by default proportional to luminance. It may be 0 where there is light.
    """

    def __init__(
        self, env: Map, n_light: int = 1, n_brdf: int = 1, density: Density | None = None
    ) -> None:
        if n_light < 0 or n_brdf < 1:
            raise ValueError(
                f"n_light is {n_light} and n_brdf {n_brdf}; they must be at least 0 and 1"
            )
        self.n_rays: int = n_light + n_brdf
        self._counts = (n_light, n_brdf)
        self._env = env
        self._light: _Sampler = env if density is None else density

    def __call__(self, points: ShadingPoints) -> Rays:
        n_light, n_brdf = self._counts
        rays: list[tuple[Any, Any]] = []
        if n_light > 0:
            wi, radiance, pdf = self._light.sample(points.random(n_light, "environment")[..., :2])
            value, other = points.eval_pdf(wi)
            share = self._share(n_light * pdf, n_brdf * other)
            rays.append((wi, _over(value * radiance * share, pdf * np.float32(n_light))))
        wi, value, pdf = points.sample(points.random(n_brdf, "brdf"))
        share = self._share(n_brdf * pdf, n_light * self._light.pdf(wi))
        radiance = self._env.radiance(wi)
        rays.append((wi, _over(value * radiance * share, pdf * np.float32(n_brdf))))
        return _flat(
            np.concatenate([wi for wi, _ in rays], axis=1),
            np.concatenate([weight for _, weight in rays], axis=1),
        )

    @staticmethod
    def _share(own: npt.NDArray[np.float32], other: npt.NDArray[np.float32]) -> Any:
        """The power heuristic, computed from the ratio so that squares do not overflow."""
        quotient = np.divide(other, own, out=np.zeros_like(own), where=own > 0)
        with np.errstate(over="ignore"):
            return (np.float32(1) / (np.float32(1) + quotient * quotient))[..., np.newaxis]
