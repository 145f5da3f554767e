"""Times a Monte Carlo study: 1,000 scenarios of 20 users on average, the paper's four planners on each, 2 processes.

Run: ``python -m benchmarks.study``. Start of the processes, store and table are inside the time. Ends with 1 where it
takes longer than it may.
"""

import sys
import tempfile
import time
from pathlib import Path

from mavplan.study.engine import run_study
from mavplan.study.settings import Settings
from mavplan.study.summary import summarise

SCENARIOS = 1000
MEAN_USERS = 20.0
PROCESSES = 2
MOST_S = 60.0


def main() -> int:
    settings = Settings(mean_users=(MEAN_USERS,), seeds=tuple(range(SCENARIOS)))
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        rows, _ = run_study(Path(folder), settings, jobs=PROCESSES)
        lines = summarise(rows)
        took_s = time.perf_counter() - start
    print(
        f"study: {SCENARIOS:,} scenarios of {lines[0].users:.1f} users × {len(settings.planners)} planners on "
        f"{PROCESSES} processes: {took_s:.1f} s (at most {MOST_S:.0f} s)"
    )
    return int(took_s > MOST_S)


if __name__ == "__main__":
    sys.exit(main())
