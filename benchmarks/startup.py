"""Whole processes, as a person starts them."""

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.timing import best_s, show

SCENARIO = Path(__file__).resolve().parents[1] / "missions" / "hppp60" / "scenario.toml"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:

        def run(*command: str) -> None:
            subprocess.run([sys.executable, *command], cwd=folder, check=True, capture_output=True)

        python_s = best_s(lambda: run("-c", "pass"))
        help_s = best_s(lambda: run("-m", "mavplan", "--help"))
        plan_s = best_s(lambda: run("-m", "mavplan", "plan", str(SCENARIO)), repeats=3)
    show(
        "start, whole processes",
        [
            ("python -c pass", f"{python_s:.3f} s", "the floor"),
            ("mavplan --help", f"{help_s:.3f} s", "wanted: under 0.1 s"),
            ("mavplan plan, 60 users, K auto", f"{plan_s:.2f} s", "wanted: under 3 s"),
        ],
    )


if __name__ == "__main__":
    main()
