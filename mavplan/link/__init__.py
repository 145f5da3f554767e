"""The link to a vehicle: transfers without I/O (`transfer` and its kinds), sessions, and the driver in `vehicle`."""
