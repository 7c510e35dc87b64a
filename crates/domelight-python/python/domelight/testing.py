"""Statistical tests for samplers and estimators: "this samples that density", "this estimates that integral".

A correct sampler fails with probability `significance`, which several tests may share: with `tests=20`, each of twenty
tests gets its Sidak share. No tolerance is chosen by hand.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypedDict

import numpy as np
import numpy.typing as npt

from . import _domelight

__all__ = ["Chi2Report", "chi2", "z_test"]


class Chi2Report(TypedDict):
    """A passed chi-squared test.

    `mass` is the integral of the density, `lost` the number of rejected samples.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float
    mass: float
    lost: int


def chi2(
    sample: Callable[[npt.NDArray[np.float32]], npt.ArrayLike],
    pdf: Callable[[npt.NDArray[np.float32]], npt.ArrayLike],
    *,
    samples: int = 100_000,
    cells: tuple[int, int] = (31, 61),
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    seed: int = 1,
    tests: int = 1,
    significance: float = 0.01,
    name: str = "sampler",
) -> Chi2Report:
    """Test a sampler of directions against its density by Pearson's chi-squared test.

    Parameters
    ----------
    sample : callable
        Takes uniform numbers (N, 3) in [0, 1) and returns unit vectors (N, 3); a row of zeros is a rejected sample.
    pdf : callable
        Takes unit vectors (N, 3) and returns their density (N,) [sr^-1]. It may integrate to less than 1: the rest is the
        probability of a rejected sample.
    samples : int, default 100000
        The number of samples.
    cells : (int, int), default (31, 61)
        Cells along the polar angle and around the axis. Take cells finer than the texels of a density that is constant
        over each: a sampler within a texel is then tested, too, and none is missed by the integration.
    axis : array_like, shape (3,)
        The polar axis of the cells; align it with narrow lobes.
    seed : int, default 1
        The seed of the uniform numbers.
    tests : int, default 1
        The number of tests that share the significance.
    significance : float, default 0.01
        The probability that a correct sampler fails any of the tests.
    name : str
        The name in messages.

    Returns
    -------
    Chi2Report

    Raises
    ------
    AssertionError
        If the samples do not follow the density, or it is negative, not finite, or integrates to more than 1, or to less
        than rejected samples explain.
    ValueError
        If a setting is invalid, or a sample is not a unit vector.
    """
    return _domelight.chi2(name, sample, pdf, samples, cells, axis, seed, tests, significance)


def z_test(
    estimator: Callable[[np.random.Generator, int], npt.ArrayLike] | npt.ArrayLike,
    reference: npt.ArrayLike,
    *,
    standard_error: npt.ArrayLike = 0.0,
    samples: int = 100_000,
    batches: int = 100,
    seed: int = 1,
    tests: int = 1,
    significance: float = 0.01,
    rounding: float = 2e-6,
    name: str = "estimator",
) -> float:
    """Test an estimator's mean against a reference.

    Parameters
    ----------
    estimator : callable or array_like
        `estimator(rng, n)` returns n independent estimates, (n,) or (n, channels); or such an array.
    reference : float or array_like, shape (channels,)
        The expected value.
    standard_error : float or array_like, shape (channels,), default 0
        The standard error of the reference; 0 if it is exact.
    samples : int, default 100000
        The number of estimates requested from a callable.
    batches : int, default 100
        The number of batches that are averaged first, at least 30.
    seed : int, default 1
        The seed of the callable's random numbers.
    tests, significance
        As in `chi2`.
    rounding : float, default 2e-6
        The relative difference attributed to rounding.
    name : str
        The name in messages.

    Returns
    -------
    float
        The smallest p-value of the channels.

    Raises
    ------
    AssertionError
        If a mean differs significantly from the reference, or is not finite.
    ValueError
        If a setting is invalid.
    """
    if callable(estimator):
        estimates = np.asarray(estimator(np.random.default_rng(seed), samples), np.float64)
    else:
        estimates = np.asarray(estimator, np.float64)
    if estimates.ndim == 1:
        estimates = estimates[:, np.newaxis]
    if estimates.ndim != 2:
        raise ValueError(f"the estimates have shape {estimates.shape}; it must be (n,) or (n, channels)")
    n, channels = estimates.shape
    if batches < 30:
        raise ValueError(f"batches is {batches}; it must be at least 30")
    if n < batches:
        raise ValueError(f"there are {n} estimates; they must be at least as many as batches, {batches}")
    # Batches whose sizes differ by at most one.
    means = np.stack([batch.mean(axis=0) for batch in np.array_split(estimates, batches)])
    values = _of_channels("reference", reference, channels)
    errors = _of_channels("standard_error", standard_error, channels)
    return _domelight.z_test(
        name, np.ascontiguousarray(means), values, errors, tests, significance, rounding
    )


def _of_channels(name: str, value: npt.ArrayLike, channels: int) -> list[float]:
    array = np.asarray(value, np.float64)
    if array.ndim > 1 or array.size not in (1, channels):
        raise ValueError(f"{name} has shape {array.shape}; it must be a number or ({channels},)")
    return [float(x) for x in np.broadcast_to(array.reshape(-1), (channels,))]
