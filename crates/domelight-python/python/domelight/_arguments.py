"""Arguments that the engine takes as fixed types, with errors that name them."""

from __future__ import annotations

import operator
from typing import Any


def whole(name: str, value: Any, least: int, most: int) -> int:
    """A whole number in a range."""
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or isinstance(value, bool) or not least <= number <= most:
        raise ValueError(f"{name} is {value!r}; it must be a whole number from {least} to {most}")
    return number


def pair(name: str, value: Any, of: str) -> tuple[int, int]:
    """Two whole numbers, such as width and height."""
    try:
        first, second = (operator.index(number) for number in value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {value!r}; it must be ({of}), two whole numbers") from None
    return first, second
