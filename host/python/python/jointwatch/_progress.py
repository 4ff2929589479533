"""Showing how far long work is: a function of the user's, or a bar of tqdm."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Callable, Optional, Union

from ._errors import UsageError

Told = Callable[[str, Optional[float], int], object]
"""Called with what is being done, its share done (0 to 1, or None) and the steps taken so far; what it raises ends the work."""

Progress = Union[bool, None, Told]
"""False or None: nothing is shown. True: a bar of tqdm."""


@contextmanager
def shown(progress: Progress) -> Iterator[Optional[Told]]:
    """The function that the extension calls while it works."""
    if progress is None or progress is False:
        yield None
    elif callable(progress):
        yield progress
    else:
        with _bar() as bar:
            yield _Bar(bar)


def _bar() -> Any:
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped, import-not-found, unused-ignore]
    except ImportError:
        raise UsageError(
            "progress = True needs the package tqdm; install it, or give a function of what is done, its share and its steps."
        ) from None
    return tqdm(unit=" steps", leave=False)


class _Bar:
    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def __call__(self, what: str, share: Optional[float], steps: int) -> None:
        bar = self._bar
        if share is None:
            bar.total, bar.n = None, steps
        else:
            bar.total, bar.n = 100, round(100 * share)
        bar.set_description(what, refresh=False)
        bar.refresh()
