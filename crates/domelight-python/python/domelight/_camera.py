"""Cameras."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, Any, TypeAlias, final

import numpy as np

from ._arguments import whole

if TYPE_CHECKING:
    import numpy.typing as npt

_Vector: TypeAlias = "tuple[float, float, float]"


@final
class Camera:
    """A camera. Omitted parts come from the scene's own camera, or from one that frames the scene. Cameras can be pickled and
    compared.

    Parameters
    ----------
    origin : array_like, shape (3,), optional
        Position of the camera, or any point on the axis of an orthographic camera.
    target : array_like, shape (3,), optional
        A point that it looks at.
    up : array_like, shape (3,), optional
        A direction that points up in the picture.
    fov : float, optional
        Vertical field of view of a perspective camera, in (0, 180) [degrees].
    ortho : float, optional
        Height of an orthographic camera's picture in world units, positive.
    shift : (float, float), default (0, 0)
        Moves the picture across the image plane, to the right in widths of the picture and up in heights of it, as a
        view camera does; verticals stay parallel.
    aperture : float, optional
        Radius of a thin lens in world units, ≥ 0; perspective cameras only.
    focus_distance : float, optional
        Distance along the axis at which the lens is sharp, positive; required with `aperture`.
    blades : int, default 0
        Number of aperture blades; fewer than 3 mean a round aperture.
    """

    __slots__ = ("_parts",)
    # What the engine reads.
    _parts: tuple[
        tuple[_Vector | None, _Vector | None, _Vector | None],
        float | None,
        float | None,
        tuple[float, float],
        tuple[float, float, int] | None,
    ]

    def __init__(
        self,
        *,
        origin: npt.ArrayLike | None = None,
        target: npt.ArrayLike | None = None,
        up: npt.ArrayLike | None = None,
        fov: float | None = None,
        ortho: float | None = None,
        shift: tuple[float, float] = (0.0, 0.0),
        aperture: float | None = None,
        focus_distance: float | None = None,
        blades: int = 0,
    ) -> None:
        if fov is not None and ortho is not None:
            raise ValueError("give fov or ortho, not both")
        right, above = (_single(number) for number in shift)
        if not (math.isfinite(right) and math.isfinite(above)):
            raise ValueError(f"shift is ({right}, {above}); it must be two finite numbers")
        self._parts = (
            (_vector("origin", origin), _vector("target", target), _vector("up", up)),
            None if fov is None else _single(fov),
            None if ortho is None else _single(ortho),
            (right, above),
            _lens(aperture, focus_distance, blades),
        )

    @property
    def origin(self) -> npt.NDArray[np.float32] | None:
        """ndarray, shape (3,), or None: position of the camera."""
        return _array(self._parts[0][0])

    @property
    def target(self) -> npt.NDArray[np.float32] | None:
        """ndarray, shape (3,), or None: a point that it looks at."""
        return _array(self._parts[0][1])

    @property
    def up(self) -> npt.NDArray[np.float32] | None:
        """ndarray, shape (3,), or None: a direction that points up in the picture."""
        return _array(self._parts[0][2])

    @property
    def fov(self) -> float | None:
        """float or None: vertical field of view [degrees]."""
        return self._parts[1]

    @property
    def ortho(self) -> float | None:
        """float or None: height of an orthographic picture in world units."""
        return self._parts[2]

    @property
    def shift(self) -> tuple[float, float]:
        """(float, float): shift of the picture to the right, in widths, and up, in heights."""
        return self._parts[3]

    @property
    def aperture(self) -> float | None:
        """float or None: radius of the lens in world units."""
        lens = self._parts[4]
        return lens[0] if lens else None

    @property
    def focus_distance(self) -> float | None:
        """float or None: distance along the axis at which the lens is sharp."""
        lens = self._parts[4]
        return lens[1] if lens else None

    @property
    def blades(self) -> int:
        """int: number of aperture blades."""
        lens = self._parts[4]
        return lens[2] if lens else 0

    def __repr__(self) -> str:
        vectors, fov, ortho, shift, lens = self._parts
        given: dict[str, Any] = dict(zip(("origin", "target", "up"), vectors), fov=fov, ortho=ortho)
        if shift != (0.0, 0.0):
            given["shift"] = shift
        if lens:
            given.update(zip(("aperture", "focus_distance", "blades"), lens))
        return f"Camera({', '.join(f'{name}={_text(value)}' for name, value in given.items() if value is not None)})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self._parts == other._parts

    def __hash__(self) -> int:
        return hash(self._parts)

    def __getstate__(self) -> Any:
        return self._parts

    def __setstate__(self, parts: Any) -> None:
        self._parts = parts


def _single(number: float) -> float:
    """A number in single precision."""
    return array("f", [number])[0]


def _vector(name: str, value: npt.ArrayLike | None) -> _Vector | None:
    """Three numbers in single precision."""
    if value is None:
        return None
    is_only_dlpack = hasattr(value, "__dlpack__") and not hasattr(value, "__array__")
    given = np.from_dlpack(value) if is_only_dlpack else np.asarray(value)  # type: ignore[arg-type]
    if given.dtype.kind not in "fiub":
        raise ValueError(f"{name} has dtype {given.dtype}; it must be real numbers")
    if given.size != 3:
        raise ValueError(f"{name} has shape {given.shape}; it must be (3,)")
    x, y, z = given.astype(np.float32).ravel().tolist()
    return x, y, z


def _lens(aperture: float | None, focus_distance: float | None, blades: int) -> tuple[float, float, int] | None:
    """The lens of an aperture and a focus distance."""
    if aperture is None:
        if focus_distance is not None:
            raise ValueError("focus_distance needs an aperture")
        return None
    if focus_distance is None:
        raise ValueError("aperture needs a focus_distance")
    radius, distance = _single(aperture), _single(focus_distance)
    if not 0.0 <= radius < math.inf:
        raise ValueError(f"aperture is {_text(radius)}; it must be finite and not negative")
    if not 0.0 < distance < math.inf:
        raise ValueError(f"focus_distance is {_text(distance)}; it must be positive and finite")
    return radius, distance, whole("blades", blades, 0, 2**32 - 1)


def _array(vector: _Vector | None) -> npt.NDArray[np.float32] | None:
    return None if vector is None else np.array(vector, np.float32)


def _text(value: Any) -> str:
    """Numbers in single precision with the digits that they need."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_text, value))})"
    return str(value if isinstance(value, int) else np.float32(value)).removesuffix(".0")
