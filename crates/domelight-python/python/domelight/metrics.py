"""Errors of a picture against its reference.

All functions take linear pictures of shape (H, W, 3), the tested picture first, and compute in double precision. Mean
errors of pictures with NaN or infinities are NaN or infinite; the trimmed mean drops the worst pixels, and FLIP takes
NaN for black and infinity for white.
"""

from __future__ import annotations

from typing import TypedDict

import numpy as np
import numpy.typing as npt

from ._domelight import compare_pictures, error_map, flip as _flip, hdr_flip as _hdr_flip

__all__ = [
    "Comparison",
    "absolute_error_map",
    "compare",
    "flip",
    "flip_map",
    "hdr_flip",
    "hdr_flip_map",
    "mse",
    "psnr",
    "rel_mse",
    "rel_mse_trimmed",
    "relative_error_map",
]


class Comparison(TypedDict):
    """All errors of a picture I against its reference R.

    The errors are means over pixels and channels; `psnr` is in dB relative to the largest channel of the reference.
    """

    n_pixels: int
    mse: float
    rel_mse: float
    rel_mse_trimmed: float
    psnr: float
    mean: list[float]
    mean_reference: list[float]
    mean_ratio: list[float]
    n_non_finite: int


def compare(
    test: npt.ArrayLike, reference: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> Comparison:
    """Compute all errors at once.

    Parameters
    ----------
    test, reference : array_like, shape (H, W, 3)
        Linear pictures of the same size.
    mask : array_like, shape (H, W), optional
        Nonzero for the pixels to compare.

    Returns
    -------
    Comparison
        A dictionary.
    """
    return compare_pictures(test, reference, mask)


def mse(test: npt.ArrayLike, reference: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> float:
    """Mean over pixels and channels of (I - R)^2."""
    return compare(test, reference, mask)["mse"]


def rel_mse(
    test: npt.ArrayLike, reference: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> float:
    """Mean over pixels and channels of (I - R)^2 / (R^2 + 0.01)."""
    return compare(test, reference, mask)["rel_mse"]


def rel_mse_trimmed(
    test: npt.ArrayLike, reference: npt.ArrayLike, mask: npt.ArrayLike | None = None
) -> float:
    """`rel_mse` without the worst 0.1 % of the pixels, so that a few fireflies do not dominate."""
    return compare(test, reference, mask)["rel_mse_trimmed"]


def psnr(test: npt.ArrayLike, reference: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> float:
    """10 log10(peak^2 / MSE) [dB]; the peak is the largest channel of the reference. Infinite for equal pictures."""
    return compare(test, reference, mask)["psnr"]


def relative_error_map(test: npt.ArrayLike, reference: npt.ArrayLike) -> npt.NDArray[np.float32]:
    """Square root of the mean over channels of (I - R)^2 / (R^2 + 0.01), shape (H, W)."""
    return error_map(test, reference, True)


def absolute_error_map(test: npt.ArrayLike, reference: npt.ArrayLike) -> npt.NDArray[np.float32]:
    """Square root of the mean over channels of (I - R)^2, shape (H, W)."""
    return error_map(test, reference, False)


def flip_map(
    test: npt.ArrayLike, reference: npt.ArrayLike, pixels_per_degree: float | None = None
) -> npt.NDArray[np.float32]:
    """LDR-FLIP of each pixel, in [0, 1].

    Parameters
    ----------
    test, reference : array_like, shape (H, W, 3)
        Linear display light, after the tone curve and before sRGB encoding; clamped to [0, 1], NaN to 0.
    pixels_per_degree : float, optional
        Angular resolution, from 2 to 10000; by default 67.02, for a 0.7 m wide 4K screen at a distance of 0.7 m.
    """
    return _flip(test, reference, pixels_per_degree)


def flip(
    test: npt.ArrayLike, reference: npt.ArrayLike, pixels_per_degree: float | None = None
) -> float:
    """The mean of `flip_map`."""
    return float(np.mean(flip_map(test, reference, pixels_per_degree), dtype=np.float64))


def hdr_flip_map(
    test: npt.ArrayLike, reference: npt.ArrayLike, pixels_per_degree: float | None = None
) -> npt.NDArray[np.float32]:
    """HDR-FLIP of each pixel, in [0, 1], for linear radiance; NaN counts as 0, and infinity as white at every exposure."""
    return _hdr_flip(test, reference, pixels_per_degree)


def hdr_flip(
    test: npt.ArrayLike, reference: npt.ArrayLike, pixels_per_degree: float | None = None
) -> float:
    """The mean of `hdr_flip_map`."""
    return float(np.mean(hdr_flip_map(test, reference, pixels_per_degree), dtype=np.float64))
