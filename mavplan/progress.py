"""Telling how far a piece of work is, to whoever shows it."""

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""Called with what is done and what there is to do."""

PARTS = 1000
"""What shares of a whole are told in."""


def tell_share(progress: Progress | None, share: float) -> None:
    """Tell how much of the work is done, from 0 to 1."""
    if progress is not None:
        progress(round(PARTS * share), PARTS)


def part_of(progress: Progress | None, number: int, parts: int) -> Progress:
    """Return what tells the progress of one of several equal parts, counted from 0, as that of all of them."""

    def tell(done: int, todo: int) -> None:
        if progress is not None:
            within = min(done / todo, 1.0) if todo > 0 else 0.0
            progress(round(PARTS * min(number + within, parts)), PARTS * parts)

    return tell
