"""XML as every file of an FMU has it."""

from __future__ import annotations

from xml.etree import ElementTree


def xml(root: ElementTree.Element) -> bytes:
    """The document of an element: UTF-8, indented by two."""
    ElementTree.indent(root)
    head = b'<?xml version="1.0" encoding="UTF-8"?>\n'
    return head + ElementTree.tostring(root, encoding="unicode").encode() + b"\n"
