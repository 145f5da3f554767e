"""Flying a mission: what is looked at before, the start, and watching it to its end. No I/O but in `run`."""
