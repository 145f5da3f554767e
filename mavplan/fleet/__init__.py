"""Several vehicles at once: users divided among them, and no two of them in one place at one time."""
