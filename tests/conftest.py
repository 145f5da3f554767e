"""Settings of all tests: hypothesis without a clock, as a busy machine is no fault of the code; interrupts arrive."""

import signal

from hypothesis import settings

settings.register_profile("mavplan", deadline=None)
settings.load_profile("mavplan")

# A shell's background job ignores interrupts, and so would every process that a test starts and interrupts.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
