"""The paper's regime, in one place: how users are drawn, over which radio, and what a study varies by default.

S. Zhang et al., EURASIP J. Wireless Com. Network. 2021:107, doi 10.1186/s13638-021-01987-3, section 7. The table of
parameters is lost in our copy of the paper. **Every number here is a stand-in**, chosen so that the published
orderings come out: those of `mavplan.hppp` (square, pairs) and of `mavplan.scenario.sections` (radio, altitude), and
the ones below.
"""

import dataclasses
import math
from typing import Any, Literal

from mavplan.hppp import MIN_PAIRS, PAIR_RADIUS_M, SIDE_M
from mavplan.radio import coverage_radius_m
from mavplan.scenario.sections import D2D, Radio, Vehicle

MEAN_USERS = (15.0, 16.0, 20.0)
"""λ: mean number of users in the whole square; the paper speaks of 15 to 20."""

CLUSTERS = 4
"""K."""

PLANNERS = ("tloaik", "stoaik", "boaik", "sbw")
"""The paper's three planners and its benchmark."""

ORDER_OF_INDEX = ("boaik", "stoaik", "tloaik", "sbw")
"""The published order of ρ_e, greatest first."""

BENCHMARK = "sbw"

SEEDS = 300

RADIO = Radio()
"""Path loss, link budget and threshold; with `ALTITUDE_M` it covers `RADIUS_M`."""

SNR_THRESHOLD_DB = RADIO.snr_threshold_db

ALTITUDE_M = Vehicle().altitude_m

RADIUS_M = coverage_radius_m(RADIO, ALTITUDE_M)
"""R of the regime."""

IDEAL_LINK = D2D(matching="given", link="ideal", range_m=PAIR_RADIUS_M)
"""A user that its mate serves gets its mate's rate."""

Held = Literal["radius", "power"]
"""What stays as it is while threshold and altitude vary: the radius R, or the transmit power."""


def power_dbm(altitude_m: float, snr_threshold_db: float, held: Held) -> float:
    """Return the transmit power of a case, see `radio_of`; it may be more than any radio has."""
    if held == "power":
        return RADIO.tx_power_dbm
    spread = math.hypot(RADIUS_M, altitude_m) / math.hypot(RADIUS_M, ALTITUDE_M)
    path_loss_db = 10.0 * RADIO.path_loss_exponent * math.log10(spread)
    return RADIO.tx_power_dbm + (snr_threshold_db - SNR_THRESHOLD_DB) + path_loss_db


def radio_of(altitude_m: float, snr_threshold_db: float, held: Held) -> Radio:
    """Return the radio of a case.

    Parameters
    ----------
    altitude_m, snr_threshold_db
        H and γ_th of the case.
    held
        ``radius``: the transmit power is what it takes for the SNR to be γ_th at the distance R = `RADIUS_M` of the
        regime, so that threshold and altitude change the rates and not who is covered. ``power``: the regime's
        power, and R follows from equation (4).

    Returns
    -------
    The regime's own radio, to the last bit, at the regime's own altitude and threshold.
    """
    return dataclasses.replace(
        RADIO, tx_power_dbm=power_dbm(altitude_m, snr_threshold_db, held), snr_threshold_db=snr_threshold_db
    )


def stand_ins() -> dict[str, Any]:
    """Return the numbers that no study varies, as they are written into its folder."""
    return {
        "side_m": SIDE_M,
        "pair_radius_m": PAIR_RADIUS_M,
        "min_pairs": MIN_PAIRS,
        "radius_m": RADIUS_M,
        "radio": dataclasses.asdict(RADIO),
        "d2d": dataclasses.asdict(IDEAL_LINK),
    }
