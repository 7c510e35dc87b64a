"""What other packages take and give, imported only where it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._domelight import Film


def film_to_xarray(film: Film) -> Any:
    """The film as an `xarray.Dataset` with the dimensions y, x and channel."""
    import xarray

    layers = {}
    for name in film.keys():
        values = film[name]
        dimensions = ("y", "x") if values.ndim == 2 else ("y", "x", "channel")
        layers[name] = (dimensions, values)
    attributes = {"strategy": film.strategy, "complete": film.complete}
    return xarray.Dataset(layers, coords={"channel": ["r", "g", "b"]}, attrs=attributes)
