"""How the mock flies: where it is at any time, and how each firmware arms, flies a mission, returns and lands.

Nothing here knows messages, sockets or a clock: time is an argument, and places are metres north, east and up.
"""
