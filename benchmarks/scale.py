"""From a users file to a written mission for 1,000 to 100,000 users, and the quality where the small planner runs too.

Users are HPPP at the density of 60 in 2 km × 2 km, home in the middle, R 300 m from 100 m, end ``stay``, 2 Mbit each.
``python -m benchmarks.scale [length|time] [USERS ...]``; with ``quality`` the comparison with the small planners.
"""

import dataclasses
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.timing import show_table
from mavplan.geo import LocalPlane
from mavplan.hppp import SIDE_M, draw_users
from mavplan.plan import make_plan
from mavplan.scenario import load_scenario

USERS = (1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000)
DENSITY_USERS = 60
HOME = (47.5, 19.0)
LOOK_S = 0.1
PAGE = os.sysconf("SC_PAGE_SIZE")
GIB = 2**30
TOML = """users = "users.csv"
[home]
lat_deg = 47.5
lon_deg = 19.0
alt_amsl_m = 100.0
[radio]
noise_dbm = -102.9734
[vehicle]
end = "stay"
[service]
demand_mbit = 2
"""


def write_scenario(folder: Path, users: int, seed: int = 0) -> Path:
    """Write a scenario of about so many users, and return its file."""
    side_m = SIDE_M * math.sqrt(users / DENSITY_USERS)
    xy_m, _ = draw_users(users, side_m, seed=seed)
    lat_deg, lon_deg = LocalPlane(*HOME).to_lat_lon_deg(xy_m - side_m / 2)
    rows = (f"u{n},{lat:.7f},{lon:.7f}\n" for n, (lat, lon) in enumerate(zip(lat_deg, lon_deg, strict=True)))
    (folder / "users.csv").write_text("name,lat_deg,lon_deg\n" + "".join(rows))
    (folder / "scenario.toml").write_text(TOML)
    return folder / "scenario.toml"


@dataclasses.dataclass(frozen=True)
class Run:
    """What a whole process and those that it started took."""

    users: int
    wall_s: float
    cpu_s: float
    peak_gib: float
    path_m: float
    mission_s: float


def planned(planner: str, users: int) -> Run:
    """Run ``mavplan plan`` as anybody would, and watch it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenario = write_scenario(folder, users)
        command = [sys.executable, "-m", "mavplan", "plan", scenario, "--planner", planner, "--json"]
        begun = time.monotonic()
        with (folder / "out.json").open("wb") as output:
            process = subprocess.Popen(
                [*command, "-o", folder / "out.plan"], stdout=output, start_new_session=True
            )
        peak, pid = 0, 0
        try:
            while not pid:
                pid, status, used = os.wait4(process.pid, os.WNOHANG)
                peak = max(peak, group_bytes(process.pid))
                time.sleep(LOOK_S)
        finally:
            if not pid:  # its workers end with it
                process.kill()
        wall_s = time.monotonic() - begun
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise RuntimeError(f"{planner}, {users} users: exit code {process.returncode}")
        found = json.loads((folder / "out.json").read_text())
    cpu_s = used.ru_utime + used.ru_stime
    return Run(
        len(found["users"]), wall_s, cpu_s, peak / GIB, float(found["length_m"]), float(found["mission_s"])
    )


def group_bytes(group: int) -> int:
    """Return the memory of all processes of a group: what each holds, shared pages counted in each."""
    held = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            if int(path.read_text().rpartition(") ")[2].split()[2]) == group:
                held += int((path.parent / "statm").read_text().split()[1]) * PAGE
        except OSError:  # gone meanwhile
            continue
    return held


def growth(runs: list[Run]) -> list[str]:
    """Return the exponent of CPU time over users from each row to the next."""
    found = ["–"]
    for before, after in itertools.pairwise(runs):
        found.append(f"{math.log(after.cpu_s / before.cpu_s) / math.log(after.users / before.users):.2f}")
    return found


def scale(planner: str, users: tuple[int, ...]) -> None:
    runs = [planned(planner, count) for count in users]
    rows = [
        (
            f"{run.users:,}",
            f"{run.wall_s:.1f}",
            f"{run.cpu_s:.1f}",
            exponent,
            f"{run.peak_gib:.2f}",
            f"{run.path_m / run.users:.1f}",
            f"{run.mission_s / run.users:.2f}",
        )
        for run, exponent in zip(runs, growth(runs), strict=True)
    ]
    columns = ("users", "seconds", "CPU s", "growth", "GiB", "path m a user", "mission s a user")
    print(f"\n--planner {planner}, from the users file to the plan's files; {os.cpu_count()} cores")
    show_table(columns, rows, words=0)


def quality() -> None:
    """Compare plans region by region with those of the small planners, which know how to end by the clock."""
    rows = []
    for planner, limit, users in (("length", "REGION", (1_000, 2_000)), ("time", "TOGETHER", (120, 200))):
        module = sys.modules[f"mavplan.planners.{'least_time' if planner == 'time' else planner}"]
        usual = getattr(module, limit)
        for count in users:
            ratios, seconds = [], [0.0, 0.0]
            for seed in range(3):
                with tempfile.TemporaryDirectory() as name:
                    scenario = load_scenario(write_scenario(Path(name), count, seed))
                scenario = dataclasses.replace(
                    scenario, planner=dataclasses.replace(scenario.planner, name=planner)
                )
                values = []
                for which, bound in enumerate((0, 10**9)):
                    setattr(module, limit, bound)
                    begun = time.perf_counter()
                    plan = make_plan(scenario)
                    seconds[which] += (time.perf_counter() - begun) / 3
                    asked_s = plan.forecast.flight_s + float(plan.holds.asked_s.sum())
                    values.append(plan.trajectory.length_m if planner == "length" else asked_s)
                setattr(module, limit, usual)
                ratios.append(values[0] / values[1])
            rows.append(
                (planner, f"{count:,}", f"{np.mean(ratios):.3f}", f"{seconds[0]:.1f}", f"{seconds[1]:.1f}")
            )
    print("\nregion by region beside the small planner, 30 s; three draws, one core")
    show_table(("planner", "users", "ratio", "s in regions", "s together"), rows)


def main() -> None:
    asked = sys.argv[1:]
    if "quality" in asked:
        quality()
        return
    users = tuple(int(word) for word in asked if word.isdigit()) or USERS
    for planner in [word for word in asked if not word.isdigit()] or ["length", "time"]:
        scale(planner, users)


if __name__ == "__main__":
    main()
