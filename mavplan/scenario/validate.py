"""One table of the file against its section's type: what pydantic finds, said in our words, each with its place."""

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import ValidationError

from mavplan.scenario.reference import Key
from mavplan.scenario.report import Report, key_name, shown


def sound_values(
    kind: type[Any],
    keys: Mapping[str, Key],
    table: Mapping[str, Any],
    where: str,
    report: Report,
    remedy: Callable[[str], str],
) -> dict[str, Any]:
    """Return the values of a table that are as its section wants them; each of the others is a problem.

    Parameters
    ----------
    kind
        The section: a dataclass that checks itself.
    keys
        Its keys, as `mavplan.scenario.reference.keys_of` describes them.
    table
        What the file says.
    where
        Place of the table; a key's name follows it.
    report
        Takes the problems.
    remedy
        What to say after "is not known", by the unknown key.
    """
    good = dict(table)
    for key in _wrong_keys(kind, table):
        good.pop(key, None)
        place = f"{where} {key_name(key)}"
        if key not in keys:
            report.error(place, f"is not known{remedy(key)}", "unknown-key")
        elif key not in table:
            report.error(place, f"is missing; needed is {keys[key].allowed_with_unit}", "missing-key")
        else:
            message = f"found {shown(table[key])}; allowed is {keys[key].allowed_with_unit}"
            report.error(place, message, "out-of-range")
    return good


def _wrong_keys(kind: type[Any], table: Mapping[str, Any]) -> list[str]:
    """Return each key with which pydantic finds something wrong, once."""
    try:
        kind(**table)
    except ValidationError as error:
        found = error.errors(include_url=False, include_context=False, include_input=False)
        return list(dict.fromkeys(str(entry["loc"][0]) for entry in found))
    return []
