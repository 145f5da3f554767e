"""The gallery flown by whatever answers at CONN: planned about its own home, uploaded, read back, flown, proved.

``make test-vehicle CONN=udp:0.0.0.0:14550``. A flight is asked for with its distance, height and seconds; SIM=1 says
yes beforehand, for a simulator. SCENARIOS=valley,coast takes only those.
"""

import dataclasses
import json
import math

import numpy as np
import pytest

from mavplan.scenario import Home, load_scenario
from mavplan.scenario.write import scenario_toml, users_csv
from tests.test_gallery import EXAMPLES, GALLERY

from .conftest import CONN, IS_SIMULATED, OUT, WANTED, mavplan
from .moved import moved

SCENARIOS = [name for name in EXAMPLES if not WANTED or name in WANTED.split(",")]


def agreed(capfd, words):
    """Ask the person at the terminal, past pytest's capture."""
    if IS_SIMULATED:
        return True
    with capfd.disabled():
        return input(f"\n{words}\nFly this? Somebody must be at the sticks. [y/N] ").strip().lower() in {
            "y",
            "yes",
        }


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_flight_gives_every_user_what_the_plan_promised(vehicle, name, capfd):
    folder = OUT / vehicle.autopilot / name
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    row = {"scenario": name, "outcome": "planning"}
    vehicle.rows.append(row)

    scenario = moved(load_scenario(GALLERY / name / "scenario.toml"), Home(**vehicle.home))
    for_it = dataclasses.replace(scenario.vehicle, autopilot=vehicle.autopilot)
    scenario = dataclasses.replace(scenario, vehicle=for_it)
    (folder / "scenario.toml").write_text(scenario_toml(scenario, "users.csv", f"{name}, moved"), "utf-8")
    (folder / "users.csv").write_text(users_csv(scenario.users), "utf-8")
    mission = folder / f"{name}.plan"
    code, out, err = mavplan("plan", folder / "scenario.toml", "-o", mission, "--json")
    assert code == 0, err
    plan = json.loads(out)
    row |= {"forecast s": round(plan["mission_s"]), "outcome": "uploading"}

    code, out, err = mavplan("upload", mission, "--conn", CONN, "--json", timeout_s=900.0)
    assert code == 0, err
    row |= {
        "items": json.loads(out)["items"],
        "upload s": json.loads(out)["upload_s"],
        "outcome": "verifying",
    }
    code, _, err = mavplan("verify", mission, "--conn", CONN)
    assert code == 0, err
    code, _, err = mavplan("download", "--conn", CONN, "-o", folder / "held.plan")
    assert code == 0, err

    home = scenario.home
    away_m = max(np.linalg.norm(scenario.users.xy_m, axis=1))
    words = (
        f"{name}: {plan['length_m']:,.0f} m, {math.ceil(away_m)} m away at most, {for_it.altitude_m:g} m above home "
        f"({home.lat_deg:.6f}, {home.lon_deg:.6f}), {plan['mission_s']:,.0f} s, then {for_it.end}."
    )
    if not agreed(capfd, words):
        row["outcome"] = "not flown"
        pytest.skip("nobody said yes")
    row["outcome"] = "flying"
    log = folder / f"{name}.tlog"
    yes = ["--yes"] * (1 if for_it.end == "rtl" else 2)
    code, out, err = mavplan(
        "fly", mission, "--conn", CONN, *yes, "--record", log, "--json", timeout_s=2 * plan["mission_s"] + 300
    )
    assert code == 0, f"{err}\n{out}"
    row["outcome"] = "proving"

    code, out, err = mavplan("prove", log, "--plan", mission, "-o", folder / "proof.png", "--json")
    proof = json.loads(out) if out else {}
    assert code == 0, f"{err}\n{[user for user in proof.get('users', ()) if not user['met']]}"
    off = proof["flown_s"] / proof["forecast_s"] - 1
    row |= {
        "flown s": round(proof["flown_s"]),
        "off": f"{off:+.1%}",
        "demands met": f"{proof['users_met']} of {len(proof['users'])}",
        "outcome": "proved",
    }
    assert proof["all_met"]
    if IS_SIMULATED:  # outside there is wind
        assert abs(off) < 0.05
