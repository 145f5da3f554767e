"""Best-of-several timing and plain tables."""

import time
from collections.abc import Callable, Iterable, Sequence


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


def show_table(columns: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1) -> None:
    """Print a table as it stands in the documentation; behind the first ``words`` columns all are numbers."""
    from rich.box import MARKDOWN
    from rich.table import Table

    from mavplan.cli.console import stdout

    table = Table(box=MARKDOWN)
    for place, name in enumerate(columns):
        table.add_column(name, justify="left" if place < words else "right")
    for row in rows:
        table.add_row(*row)
    stdout().print(table)
