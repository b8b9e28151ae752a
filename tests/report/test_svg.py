"""Drawings are inert before they come into a page."""

from __future__ import annotations

import pytest

from airground_drake.report.figures import svg

SOURCE = (
    '<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" xmlns:x="http://www.w3.org/1999/xlink" '
    'width="9pt" viewBox="0 0 9 9" onload="a()"><script>a()</script><style>@import "http://e"</style>'
    '<image href="http://e/i.png"/><defs><path id="p" d="M 0.123456 1"/><path id="unused" d="M 0 1"/></defs>'
    '<a x:href="http://e"><use x:href="#p" fill="url(#p)"/></a><rect fill="url(http://e)"/></svg>'
)


def test_inert_and_prefixed() -> None:
    text = svg.inline(SOURCE, "n", "T & t", "D")
    assert not any(word in text for word in ("script", "style", "onload", "http://e", "image", "unused", "width"))
    assert 'id="n-p"' in text
    assert text.count("href=") == text.count('href="#n-p"') == 1
    assert "url(#n-p)" in text
    assert 'd="M 0.12 1"' in text
    assert '<title id="n-title">T &amp; t</title>' in text


@pytest.mark.parametrize("source", ["<svg", "<html/>", "no"])
def test_refuses_what_is_no_svg(source: str) -> None:
    with pytest.raises(ValueError, match=r"XML|root element"):
        svg.inline(source, "n", "t", "d")


def test_styles_become_attributes_of_the_same_meaning() -> None:
    style = "fill: #123456; font: 700 9px 'A', sans-serif; text-anchor: middle; background: url(http://e); x: y"
    source = SOURCE.replace('<rect fill="url(http://e)"/>', f'<text style="{style}">t</text>')
    text = svg.inline(source, "n", "T", "D")
    assert "style" not in text
    assert "background" not in text
    for attribute in ('fill="#123456"', 'font-weight="700"', 'font-size="9px"', 'text-anchor="middle"'):
        assert attribute in text


def test_a_drawing_may_have_a_width_of_its_own() -> None:
    assert 'width="18"' in svg.inline(SOURCE, "n", "T", "D", scale=2.0)
