"""JSON as people read and compare it: a line for each member of an object, and for each record of a list.

The standard library's own indentation gives each figure of a list a line, and is written by Python character by
character: seconds for the plan of very many users.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

INDENT = "  "


def laid_out(document: Mapping[str, Any], *, allow_nan: bool = False) -> str:
    """Return an object as JSON text that ends with a new line.

    Raises
    ------
    ValueError
        A number in it is not finite, which JSON itself does not know, and not allowed.
    """
    compact = json.JSONEncoder(ensure_ascii=False, allow_nan=allow_nan).encode
    return "".join(_text(document, "\n", compact)) + "\n"


def _text(value: Any, line: str, compact: Callable[[Any], str]) -> Iterator[str]:
    """Yield the parts of a value's text; ``line`` begins a line as deep as the value stands."""
    deeper = line + INDENT
    if isinstance(value, Mapping) and value:
        before = "{"
        for name, member in value.items():
            yield f"{before}{deeper}{compact(name)}: "
            yield from _text(member, deeper, compact)
            before = ","
        yield line + "}"
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        yield "[" + deeper + ("," + deeper).join(map(compact, value)) + line + "]"
    else:
        yield compact(value)
