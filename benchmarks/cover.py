"""The fewest stops for a city's 1,960 hydrants, with proof or gap: wanted within a minute."""

import time

from benchmarks.planning import HYDRANTS, hydrants
from benchmarks.timing import show
from mavplan.planners.clustering import greedy_cover_size
from mavplan.planners.cover import minimum_cover


def main() -> None:
    city = hydrants()
    rows = []
    if city is None:
        rows.append(("1,960 hydrants", "skipped", f"{HYDRANTS} is not on this machine"))
    else:
        xy_m = city.users.xy_m
        for radius_m in (100.0, 300.0):
            begin = time.perf_counter()
            found = minimum_cover(xy_m, radius_m)
            seconds = time.perf_counter() - begin
            state = "proved" if found.proved else f"at least {found.bound} proved"
            rows.append(
                (
                    f"R {radius_m:.0f} m: {found.candidates:,} centres, {found.kept_candidates:,} after reduction",
                    f"{seconds:.0f} s",
                    f"wanted: 60 s; {found.size} stops, {state}; greedy {greedy_cover_size(xy_m, radius_m)}",
                )
            )
    show("fewest stops, 1,960 hydrants", rows)


if __name__ == "__main__":
    main()
