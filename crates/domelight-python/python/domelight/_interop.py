"""Conversions for other packages, which are imported only on use."""

from __future__ import annotations

import importlib
import importlib.util
import math
import pathlib
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._domelight import Environment, Film


def film_to_xarray(film: Film) -> Any:
    """The film as an `xarray.Dataset` with the dimensions y, x and channel."""
    import xarray

    layers = {}
    for name in film.keys():
        values = film[name]
        dimensions = ("y", "x") if values.ndim == 2 else ("y", "x", "channel")
        layers[name] = (dimensions, values)
    attributes = {"strategy": film.strategy, "complete": film.complete, "exposure": film.exposure}
    return xarray.Dataset(layers, coords={"channel": ["r", "g", "b"]}, attrs=attributes)


def oidn_library() -> str | None:
    """The Open Image Denoise library in the package pyoidn, if installed."""
    package = importlib.util.find_spec("pyoidn")
    for folder in (package and package.submodule_search_locations) or ():
        for file in sorted(pathlib.Path(folder).rglob("*OpenImageDenoise*")):
            if file.is_file() and file.name in OIDN_NAMES:
                return str(file)
    return None


OIDN_NAMES = ("libOpenImageDenoise.so.2", "libOpenImageDenoise.2.dylib", "OpenImageDenoise.dll")
"""The library's file names on Linux, macOS and Windows."""


# Mitsuba's map has its first column toward -Z of its own space, where ours has its center column.


def environment_to_mitsuba(environment: Environment) -> dict[str, Any]:
    """A description of an environment for `mitsuba.load_dict`."""
    mitsuba: Any = importlib.import_module("mitsuba")

    # The axes of Mitsuba's map in world space.
    back, left = environment.directions([[0.5, 0.5], [0.25, 0.5]]).astype(np.float64)
    up = np.cross(back, left)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([left, up, back], axis=1)
    return {
        "type": "envmap",
        "bitmap": mitsuba.Bitmap(environment.map),
        "to_world": mitsuba.ScalarTransform4f(matrix.tolist()),
    }


def environment_from_mitsuba(source: Any) -> Environment:
    """The environment of a Mitsuba emitter, or of a picture in its layout."""
    mitsuba: Any = importlib.import_module("mitsuba")

    from ._domelight import Environment

    if isinstance(source, mitsuba.Bitmap):
        picture = source.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.Float32, srgb_gamma=False)
        return Environment(np.asarray(picture), rotation=180.0, name="mitsuba")
    parameters = mitsuba.traverse(source)
    if "data" in parameters and "to_world" in parameters:
        data = np.asarray(parameters["data"], dtype=np.float32)
        if data.ndim != 3 or data.shape[2] != 3:
            raise ValueError(
                f"the emitter's map has the shape {data.shape}; it must be (H, W, 3), as variants of Mitsuba for RGB have it"
            )
        up, rotation = _rotation(_matrix(parameters["to_world"]))
        scale = float(np.asarray(parameters["scale"]).ravel()[0]) if "scale" in parameters else 1.0
        return Environment(_without_margin(data), rotation=rotation, scale=scale, up=up, name="mitsuba")
    if "radiance.value" in parameters:
        value = np.asarray(parameters["radiance.value"], dtype=np.float32).ravel()
        return Environment(np.broadcast_to(value, (1, 2, 3)), name="mitsuba")
    raise ValueError(
        f"the emitter has the parameters {sorted(parameters.keys())}; it must be an 'envmap' or 'constant' of a variant "
        "of Mitsuba for RGB"
    )


def _without_margin(data: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The map without the columns that Mitsuba repeats: one at the end, or one at each end in later versions."""
    margin = data.shape[1] - 2 * data.shape[0]
    if margin not in (1, 2):
        wraps = np.array_equal(data[:, 0], data[:, -2]) and np.array_equal(data[:, 1], data[:, -1])
        margin = 2 if wraps else 1
    return data[:, margin - 1 : -1]


def _matrix(transform: Any) -> npt.NDArray[np.float64]:
    """The matrix of a transform, without the dimensions of a vectorized one."""
    return np.asarray(transform.matrix, dtype=np.float64).reshape(4, 4)


def _rotation(matrix: npt.NDArray[np.float64]) -> tuple[Any, float]:
    """The axis that the first row faces, and the rotation [degrees] about it."""
    linear = matrix[:3, :3]
    is_rotation = np.allclose(linear @ linear.T, np.eye(3), atol=1e-4) and np.linalg.det(linear) > 0.0
    x, y, z = linear[:, 2]
    for name, axis, angle in [("y", 1, math.atan2(-x, -z)), ("z", 2, math.atan2(-x, y))]:
        if is_rotation and np.allclose(linear[:, 1], np.eye(3)[axis], atol=1e-4):
            return name, math.degrees(angle)
    raise ValueError(
        f"to_world is {linear.tolist()}; it must turn the map about +Y, or about +Z with the first row up, without scale"
    )
