"""Missions: the type (`model`), what each autopilot makes of it (`autopilots`), how a plan becomes one (`build`)."""
