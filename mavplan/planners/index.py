"""The joint evaluation index ρ_e of section 6: throughput and length against those of the SBW benchmark."""

from mavplan.planners.trajectory import Trajectory


def joint_index(trajectory: Trajectory, benchmark: Trajectory) -> float | None:
    """Return ρ_e = (γ_sum/υ_b) / (L_sum/μ_b), equation (18).

    Assumed: our copy of the paper has lost (18); the ratio of the two normalised figures makes the published
    orderings come out.

    Parameters
    ----------
    trajectory, benchmark
        A plan and SBW's on the same users: υ_b and μ_b are the benchmark's sum rate and length.

    Returns
    -------
    None where one of the lengths or the benchmark's sum rate is 0.
    """
    if not (trajectory.length_m > 0 and benchmark.length_m > 0 and benchmark.sum_rate_bit_s_hz > 0):
        return None
    throughput = trajectory.sum_rate_bit_s_hz / benchmark.sum_rate_bit_s_hz
    return throughput / (trajectory.length_m / benchmark.length_m)
