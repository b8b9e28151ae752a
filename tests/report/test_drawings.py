"""Drawings of a page that was made again: coordinates may differ by rounding, and nothing else."""

import pytest

from airground_drake.report.rebuild import _is_same_drawing

DRAWING = (
    '<svg viewBox="0 0 72 72" xmlns="http://www.w3.org/2000/svg"><defs><path id="run-0-m2a" d="M 0 3 L 3 -3 z" />'
    '</defs><g transform="translate(1.5 2) rotate(-90)"><use x="4.25" y="7" href="#run-0-m2a" fill="#1a1a1a" /></g>'
    '<g transform="scale(0.01 0.01)"><circle r="4" stroke-width="0.6" opacity="1" /></g>'
    '<text x="1">at 2.5 s</text></svg>'
)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('d="M 0 3 L', 'd="M 0.02 3 L'),
        ("translate(1.5 2)", "translate(1.49 2.01)"),
        ('x="4.25"', 'x="4.26"'),
        ('viewBox="0 0 72 72"', 'viewBox="0 -0 72.01 72"'),
    ],
)
def test_rounded_coordinates_agree(old: str, new: str) -> None:
    assert old in DRAWING
    assert _is_same_drawing(DRAWING.replace(old, new), DRAWING, shapes=True)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("M 0 3 L", "M 0 \N{ARABIC-INDIC DIGIT THREE} L"),  # no number for a browser: it draws nothing
        ("M 0 3 L", "M 0 3.03 L"),
        ('href="#run-0-m2a"', 'href="#run-0.01-m2a"'),  # leads nowhere
        ('id="run-0-m2a"', 'id="run-0.01-m2a"'),
        ("#1a1a1a", "#1.01a1a1a"),  # no colour
        ("0.01 0.01", "0 0"),
        ('stroke-width="0.6"', 'stroke-width="0.59"'),
        ('opacity="1"', 'opacity="0.99"'),
        ("2000/svg", "2000.01/svg"),  # no drawing
        ("2.5 s", "2.51 s"),
        ('"4.25"', "'4.25'"),
    ],
)
def test_anything_else_is_another_drawing(old: str, new: str) -> None:
    assert old in DRAWING
    assert not _is_same_drawing(DRAWING.replace(old, new), DRAWING, shapes=True)
