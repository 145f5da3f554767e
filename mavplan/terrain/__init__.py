"""The ground under a flight: heights from a file that the user supplies, altitudes that keep clear of it, and sight.

`grid` is the ground once it is read, `read` reads it, `altitudes` bends legs over it, `flight` puts a mission's
altitudes together, `check` holds a mission against it.
"""
