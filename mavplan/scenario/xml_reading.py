"""XML that a stranger made, element by element: no entities, no document types, nothing fetched, little memory."""

import io
from collections.abc import Iterator
from xml.etree.ElementTree import Element, ParseError

from mavplan.scenario.report import Report

MAX_DEPTH = 64
"""Deeper nesting than any place file has."""


def elements(data: bytes, names: frozenset[str], label: str, report: Report) -> Iterator[Element]:
    """Yield each element of one of these names when it is complete; it is emptied afterwards.

    Elements that stand inside one that is yielded are part of it and not yielded themselves. Where the document
    breaks off or may not be read, a problem is noted and the iteration ends.

    Parameters
    ----------
    data
        The document; its own declaration says its encoding, as XML has it.
    names
        Local names, without namespace.
    label
        What to call the file in problems.
    report
        Takes the problem.
    """
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import iterparse

    depth, inside = 0, 0
    try:
        for event, element in iterparse(
            io.BytesIO(data),
            events=("start", "end"),
            forbid_dtd=True,
            forbid_entities=True,
            forbid_external=True,
        ):
            wanted = local_name(element) in names
            if event == "start":
                depth, inside = depth + 1, inside + wanted
                if depth > MAX_DEPTH:
                    report.error(label, f"is nested more than {MAX_DEPTH} deep: it is not read", "syntax")
                    return
                continue
            depth, inside = depth - 1, inside - wanted
            if wanted and inside == 0:
                yield element
            if inside == 0:
                element.clear()
    except DefusedXmlException:
        message = "has a document type or entities of its own, which may hide anything: it is not read"
        report.error(label, message, "unsafe-xml")
    except ParseError as error:
        line, column = error.position
        words = str(error).split(":", maxsplit=1)[0]
        report.error(f"{label}, line {line:,}", f"is not valid XML: {words} (column {column + 1})", "syntax")
    except (LookupError, ValueError) as error:
        # An encoding that nobody knows, or one that its text is not in.
        report.error(label, f"is not XML that can be read: {error}", "syntax")


def local_name(element: Element) -> str:
    """Return an element's name without its namespace."""
    return str(element.tag).rpartition("}")[2]


def child(element: Element, name: str) -> Element | None:
    """Return the first child of this local name."""
    return next((found for found in element if local_name(found) == name), None)


def text_of(element: Element | None) -> str:
    """Return an element's text without surplus white space; empty for none."""
    return "" if element is None else " ".join((element.text or "").split())
