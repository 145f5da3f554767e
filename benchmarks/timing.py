"""Best-of-several timing and a plain table."""

import time
from collections.abc import Callable


def best_s(work: Callable[[], object], repeats: int = 5) -> float:
    """Return the least time of several runs: what the work takes when nothing is in its way."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def show(title: str, rows: list[tuple[str, str, str]]) -> None:
    """Print rows of (what, measured, wanted or beside what)."""
    print(f"\n{title}")
    width = max(len(row[0]) for row in rows)
    for what, measured, wanted in rows:
        print(f"  {what:<{width}}  {measured:>12}  {wanted}")
