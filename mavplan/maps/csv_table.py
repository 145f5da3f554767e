"""A table of the users as CSV, for a spreadsheet: who needs what, and which stop gives it."""

import csv
import io

from mavplan.maps.content import PlanMap

_STARTS_A_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def users_csv(content: PlanMap) -> str:
    """Return a line for each user; its columns are those that a users file has, and how it is served."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    weighted = any(user.priority is not None for user in content.users)
    priority = ["priority"] if weighted else []
    writer.writerow(["name", "lat_deg", "lon_deg", "demand_mbit", *priority, "stop", "via", "mate"])
    for user in content.users:
        writer.writerow(
            [
                neutral(user.name),
                f"{user.lat_deg:.7f}",
                f"{user.lon_deg:.7f}",
                f"{user.demand_mbit:g}",
                *([f"{1.0 if user.priority is None else user.priority:g}"] if weighted else []),
                user.stop,
                "d2d" if user.d2d else "air",
                neutral(user.mate),
            ]
        )
    return text.getvalue()


def neutral(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula: an apostrophe stands before what would be one."""
    return f"'{text}" if text.startswith(_STARTS_A_FORMULA) else text
