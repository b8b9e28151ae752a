"""LaTeX to MathML, which browsers typeset without a network, a script or a font of ours."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from functools import cache
from html import unescape

from latex2mathml.converter import convert_to_element
from markupsafe import Markup, escape


@cache
def mathml(latex: str) -> Markup:
    """A formula as a block of MathML; what cannot be typeset is shown as it is written.

    The library's own text is not escaped, and a claim of others may say anything: the elements are written here.

    Args:
        latex: one row, without delimiters; what takes several rows is given as several.
    """
    try:
        root = convert_to_element(latex, display="block")
    except Exception:  # the library has an exception for each mistake, without a common base
        return Markup("<code>{}</code>").format(escape(latex))
    for element in root.iter():
        if element.tag == "mover":
            element.set("accent", "true")  # a dot over a letter is no smaller than the letter's own
        element.text = unescape(element.text or "") or None
        for name in ("href", "style"):
            element.attrib.pop(name, None)
    return Markup(ET.tostring(root, encoding="unicode"))
