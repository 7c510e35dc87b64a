"""Progress bars where the package tqdm is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Bar:
    """A bar over the share of a work that is done, in [0, 1]; it ends when all is."""

    def __init__(self, tqdm: Any, label: str) -> None:
        self._label = label
        self._bar = tqdm(total=100.0, unit="%", desc=label, bar_format="{l_bar}{bar}| {elapsed}<{remaining}")

    def __call__(self, share: float) -> None:
        self._bar.update(100.0 * share - self._bar.n)
        if share >= 1.0:
            self.close()

    def labeled(self, share: float, label: str) -> None:
        """Shows what is at work, too."""
        if label and label != self._label:
            self._label = label
            self._bar.set_description_str(label, refresh=False)
        self._bar.update(100.0 * share - self._bar.n)

    def close(self) -> None:
        self._bar.close()


def bar(progress: bool | Callable[..., object], label: str) -> Bar | None:
    """A bar if one is wanted and the package tqdm is installed."""
    if progress is not True:
        return None
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return Bar(tqdm, label)


def callback(progress: bool | Callable[..., object]) -> Callable[..., object] | None:
    """What the caller wants to be called; None if that is nothing."""
    return None if isinstance(progress, bool) else progress
