"""Prepares SVG for an HTML page: names for screen readers, unique ids, no scripts and no styles.

Styles become presentation attributes. They work under a content security policy without inline styles, and the page's
style sheet can replace each colour on a dark page.
"""

import re
import xml.etree.ElementTree as ET

NAMESPACE = "http://www.w3.org/2000/svg"
_TAG = f"{{{NAMESPACE}}}"
_XLINK = "{http://www.w3.org/1999/xlink}"
_DROPPED = {
    f"{_TAG}{name}"
    for name in ("script", "style", "metadata", "foreignObject", "image", "animate", "set", "title", "desc")
}
_REFERENCE = re.compile(r"url\(\s*['\"]?#([^'\")\s]+)['\"]?\s*\)")
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_STYLED = re.compile(r"(?:fill|stroke|font|opacity|text-anchor|dominant-baseline)[a-z-]*")
_FONT = re.compile(r"(?:(\w+) )?([\d.]+px) (.+)")  # the shorthand `font` of matplotlib 3.10: weight, size, families
_ROUNDED = {"d", "points", "transform", "x", "y", "width", "height", "cx", "cy", "rx", "ry", "r"}


def inline(svg: str, prefix: str, title: str, description: str, *, natural_size: bool = False) -> str:
    # Scripts, style sheets, handlers and references to anything outside the document are removed (a style sheet would
    # apply to the whole page), and attributes with which it could leave its place. Inline styles become attributes. Ids
    # get a prefix, so that several drawings can share a page; unused ids are removed. Coordinates are rounded to 0.01
    # units.
    # svg: the document; `viewBox` must be set.
    # description: text for readers who cannot see it.
    # natural_size: keep the size of the document; otherwise the page chooses.
    try:
        root = ET.fromstring(svg)
    except ET.ParseError as error:
        raise ValueError(f"not well-formed XML: {error}") from error
    if root.tag != f"{_TAG}svg":
        raise ValueError(f"the root element is {root.tag!r}, not an SVG")
    _drop(root)
    for element in root.iter():
        element.attrib.update(_presentation(element.attrib.pop("style", "")))
    used = {name for element in root.iter() for value in element.attrib.values() for name in _references(value)}
    for element in root.iter():
        _clean(element, prefix, used)
    for name in ("version", "class") if natural_size else ("version", "class", "width", "height"):
        root.attrib.pop(name, None)
    root.set("role", "img" if root.find(f".//{_TAG}a") is None else "group")
    root.set("aria-labelledby", f"{prefix}-title {prefix}-desc")
    for position, (name, text) in enumerate((("title", title), ("desc", description))):
        child = ET.Element(f"{_TAG}{name}", {"id": f"{prefix}-{name}"})
        child.text = text
        root.insert(position, child)
    ET.register_namespace("", NAMESPACE)
    return ET.tostring(root, encoding="unicode")


def _drop(element: ET.Element) -> None:
    for child in list(element):
        if not isinstance(child.tag, str) or child.tag in _DROPPED:
            element.remove(child)
        else:
            _drop(child)


def _presentation(style: str) -> dict[str, str]:
    """The declarations of an inline style that SVG has attributes for."""
    declared = dict(part.strip().split(":", 1) for part in style.split(";") if ":" in part)
    styles = {name.strip(): value.strip() for name, value in declared.items() if _STYLED.fullmatch(name.strip())}
    if shorthand := _FONT.fullmatch(styles.pop("font", "")):
        given = zip(("font-weight", "font-size", "font-family"), shorthand.groups(), strict=True)
        styles |= {name: value for name, value in given if value}
    return styles


def _references(value: str) -> list[str]:
    """Ids of this document that an attribute's value refers to."""
    return [value[1:]] if value.startswith("#") else _REFERENCE.findall(value)


def _clean(element: ET.Element, prefix: str, used: set[str]) -> None:
    for name in ("href", f"{_XLINK}href"):
        target = element.attrib.pop(name, "")
        if target.startswith("#"):
            element.set("href", f"#{prefix}-{target[1:]}")
    for name, value in list(element.attrib.items()):
        if name == "id" and value in used:
            element.set(name, f"{prefix}-{value}")
        elif (
            name in ("id", "overflow") or name.lower().startswith(("on", _XLINK)) or "url(" in _REFERENCE.sub("", value)
        ):
            del element.attrib[name]
        elif "url(" in value:
            element.set(name, _REFERENCE.sub(rf"url(#{prefix}-\1)", value))
        elif name in _ROUNDED and "scale" not in value and "matrix" not in value:
            rounded = _LONG_NUMBER.sub(lambda match: f"{float(match.group()):.2f}".rstrip("0").rstrip("."), value)
            element.set(name, " ".join(rounded.split()))
    if not (element.text or "").strip():  # spaces between elements are half of the bytes
        element.text = None
    element.tail = (element.tail or "").strip() or None
