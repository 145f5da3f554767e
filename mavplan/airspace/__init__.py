"""No-fly zones: where a vehicle may not be, how stops are moved out of it, and how legs go round. Pure.

`zones` has the zones in the plane with what is kept from them, `routes` the shortest ways round, `stops` the places
from which users can still be served, `around` a trajectory that keeps to all of it.
"""
