"""Progress bars, if the package tqdm is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Bar:
    """A bar for the finished fraction of a task, in [0, 1]; it closes at 1."""

    def __init__(self, tqdm: Any, label: str) -> None:
        self._label = label
        self._bar = tqdm(total=100.0, unit="%", desc=label, bar_format="{l_bar}{bar}| {elapsed}<{remaining}")

    def __call__(self, share: float) -> None:
        self._bar.update(100.0 * share - self._bar.n)
        if share >= 1.0:
            self.close()

    def labeled(self, share: float, label: str) -> None:
        """Also shows the current step."""
        if label and label != self._label:
            self._label = label
            self._bar.set_description_str(label, refresh=False)
        self._bar.update(100.0 * share - self._bar.n)

    def close(self) -> None:
        self._bar.close()


def bar(progress: bool | Callable[..., object], label: str) -> Bar | None:
    """A bar if requested and the package tqdm is installed."""
    if progress is not True:
        return None
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return Bar(tqdm, label)


def callback(progress: bool | Callable[..., object]) -> Callable[..., object] | None:
    """The caller's callback, or None."""
    return None if isinstance(progress, bool) else progress
