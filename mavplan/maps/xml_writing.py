"""XML out: elements with text that a stranger chose, escaped and without characters that XML cannot hold."""

import re
from xml.etree.ElementTree import Element, SubElement, indent, tostring

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def add(parent: Element, tag: str, text: object = None, /, **attributes: str) -> Element:
    """Append a child and return it."""
    child = SubElement(parent, tag, {key: clean(value) for key, value in attributes.items()})
    if text is not None:
        child.text = clean(str(text))
    return child


def clean(text: str) -> str:
    """Return a text without what XML 1.0 has no place for."""
    return _NOT_XML.sub("\ufffd", text)


def document(root: Element) -> str:
    """Return the text of a document."""
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"
