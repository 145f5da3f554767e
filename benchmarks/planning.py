"""Planning alone, warm, one K: the 60 users of the gallery, and a city's 1,960 hydrants at R = 300 m."""

import dataclasses
import json
from pathlib import Path

import numpy as np

from benchmarks.timing import best_s, show
from mavplan.geo import LocalPlane
from mavplan.planners import plan_trajectory
from mavplan.scenario import UNPAIRED, Home, PlannerOptions, Radio, Scenario, Users, load_scenario

ROOT = Path(__file__).resolve().parents[1]
HYDRANTS = ROOT.parent / "shared" / "data" / "cambridge_hydrants.geojson"
PAPERS = ("tloaik", "stoaik", "boaik", "sbw")
"""Planners that are timed here; `benchmarks.length` times the search for the shortest path."""

RADIO_300_M = Radio(noise_dbm=-102.9734)
"""The default radio with so much more noise that it covers 300 m from 100 m."""


def hydrants() -> Scenario | None:
    if not HYDRANTS.is_file():
        return None
    places = [feature["geometry"]["coordinates"] for feature in json.loads(HYDRANTS.read_text())["features"]]
    lon_deg, lat_deg = np.array([place[:2] for place in places]).T
    home = Home(float(lat_deg.mean()), float(lon_deg.mean()), 10.0)
    users = Users(
        names=tuple(str(index) for index in range(len(places))),
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        xy_m=LocalPlane(home.lat_deg, home.lon_deg).to_xy_m(lat_deg, lon_deg),
        demand_bit=np.full(len(places), 1e7),
        mate=np.full(len(places), UNPAIRED),
    )
    return Scenario(home, users, radio=RADIO_300_M)


def main() -> None:
    rows = []
    cases = [("60 users", load_scenario(ROOT / "missions/hppp60/scenario.toml"), 8, "under 0.05 s")]
    if (city := hydrants()) is not None:
        cases.append(("1,960 hydrants", city, 40, "under 2 s"))
    for name, scenario, clusters, wanted in cases:
        for planner in PAPERS:
            chosen = dataclasses.replace(scenario, planner=PlannerOptions(name=planner, clusters=clusters))
            seconds = best_s(lambda chosen=chosen: plan_trajectory(chosen))
            found = plan_trajectory(chosen)
            rows.append(
                (
                    f"{planner}, {name}, K = {clusters}, R = {found.radius_m:.0f} m",
                    f"{seconds:.4f} s",
                    f"wanted: {wanted}; {len(found.stop_at)} stops, {found.length_m:,.0f} m",
                )
            )
    if city is None:
        rows.append(("1,960 hydrants", "skipped", f"{HYDRANTS} is not on this machine"))
    show("planning alone, warm", rows)


if __name__ == "__main__":
    main()
