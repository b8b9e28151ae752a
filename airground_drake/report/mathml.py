"""LaTeX to MathML, which browsers typeset without a network, a script or a font of ours."""

import xml.etree.ElementTree as ET
from functools import cache
from html import unescape

from latex2mathml.converter import convert_to_element
from markupsafe import Markup, escape


@cache
def mathml(latex: str) -> Markup:
    """A formula as a block of MathML; a formula that the library cannot typeset is shown as it is written."""
    # The library does not escape text, and a third-party claim may contain anything: `ET` writes the elements.
    # latex: one row, without delimiters; a formula of several rows is given as several.
    try:
        root = convert_to_element(latex, display="block")
    except Exception:  # the library has an exception for each mistake, without a common base
        return Markup("<code>{}</code>").format(escape(latex))
    for element in root.iter():
        if element.tag == "mover":
            element.set("accent", "true")  # a dot over a letter keeps its size
        element.text = unescape(element.text or "") or None
        for name in ("href", "style"):
            element.attrib.pop(name, None)
    return Markup(ET.tostring(root, encoding="unicode"))
