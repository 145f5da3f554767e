"""What a value of a JSON file is: a number, a whole one; and how a message shows it."""

import json
import math
from typing import Any


def is_number(value: Any) -> bool:
    """Whether a JSON value is a finite number that a float holds."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < 1e300 and math.isfinite(value)


def is_whole(value: Any) -> bool:
    """Whether a JSON value is a whole number, with a point or without."""
    return is_number(value) and value == int(value)


def shown(value: Any) -> str:
    """Return a JSON value as a message shows it: short."""
    text = "nothing" if value is None else json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
