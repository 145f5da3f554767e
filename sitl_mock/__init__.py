"""sitl_mock: the vehicle's side of MAVLink missions, as ArduPilot and PX4 were measured to behave.

It knows nothing of mavplan, so that the two can disagree.
"""
