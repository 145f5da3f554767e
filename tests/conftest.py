"""Settings of all tests: hypothesis without a clock, as a busy machine is no fault of the code."""

from hypothesis import settings

settings.register_profile("mavplan", deadline=None)
settings.load_profile("mavplan")
