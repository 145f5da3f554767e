"""What users wait for, timed: ``make bench``, or one subject by ``python -m benchmarks.planning``.

Times are of this machine and noisy; ratios to a named reference in the same run hold elsewhere too.
"""
