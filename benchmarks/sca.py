"""One SCA step: the closed form beside CVXPY with Clarabel on the same instances."""

import numpy as np

from benchmarks.timing import best_s, show
from mavplan.planners.sca import MAGNIFICATIONS, closed_form_step, cvxpy_step
from mavplan.radio import Channel
from mavplan.scenario import D2D, Radio

INSTANCES = 50


def main() -> None:
    channel = Channel(Radio(), 100.0, D2D())
    rng = np.random.default_rng(0)
    instances = []
    for _ in range(INSTANCES):
        count = int(rng.integers(1, 21))
        away, angle = channel.radius_m * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)
        instances.append((np.zeros(2), np.column_stack([away * np.cos(angle), away * np.sin(angle)])))
    each = {
        step: best_s(lambda step=step: [step(stop, users, channel) for stop, users in instances], 3)
        / INSTANCES
        for step in (closed_form_step, cvxpy_step)
    }
    fast_s, slow_s = each[closed_form_step], each[cvxpy_step]
    solves = len(MAGNIFICATIONS)
    show(
        "one SCA step, 1 to 20 users",
        [
            ("closed form", f"{fast_s * 1e6:.0f} µs", ""),
            (
                "CVXPY and Clarabel, to 1e-7 m",
                f"{slow_s * 1e6:.0f} µs",
                f"{slow_s / fast_s:.0f} times as long",
            ),
            (
                f"one of its {solves} solves",
                f"{slow_s / solves * 1e6:.0f} µs",
                f"{slow_s / solves / fast_s:.0f} times as long; wanted: 100",
            ),
        ],
    )


if __name__ == "__main__":
    main()
