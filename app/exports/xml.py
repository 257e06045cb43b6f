"""XML documents: elements with text in which nothing is that XML does not allow."""

from __future__ import annotations

import re
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

# what is left of Unicode where XML 1.0 allows no more (section 2.2)
NOT_ALLOWED: Final = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def add(parent: Element, name: str, text: str | None = None, /, **attributes: str) -> Element:
    """A new last child of an element."""
    child = SubElement(parent, name, {key: clean(value) for key, value in attributes.items()})
    if text is not None:
        child.text = clean(text)
    return child


def clean(text: str) -> str:
    """A text without the characters that XML has no place for."""
    return NOT_ALLOWED.sub("", text)


def document(root: Element) -> bytes:
    """A document as it is sent, in UTF-8."""
    indent(root, " ")
    written: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return written + b"\n"
