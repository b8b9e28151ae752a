"""Images of maps: occupied, free and unknown cells, by ROS's rule; broken and hostile files."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from airground_drake.scenario.maps.images import occupancy
from airground_drake.scenario.maps.rectangles import MOST_CELLS

SHAPES = st.tuples(st.integers(1, 6), st.integers(1, 6))
SHARES = st.floats(0.0, 1.0)
GREYS = arrays(np.uint8, SHAPES, elements=st.one_of(st.integers(0, 255), st.sampled_from([0, 50, 205, 254])))
COLOURS = arrays(np.uint8, SHAPES.map(lambda shape: (*shape, 4)), elements=st.sampled_from([0, 9, 205, 254, 255]))


def png(image: Image.Image) -> bytes:
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()


def pgm(grey: np.ndarray, kind: bytes = b"P5") -> bytes:
    head = kind + b"\n# by hand\n%d %d\n255\n" % grey.shape[::-1]
    return head + (grey.tobytes() if kind == b"P5" else b" ".join(b"%d" % each for each in grey.ravel()))


def kind_of(x: float, opaque: bool, above: float, below: float, negate: bool) -> str:
    """What a cell is, from the definition."""
    p = x / 255 if negate else (255 - x) / 255
    if not opaque or x == 205 or (negate and x == 50):
        return "unknown"
    return "occupied" if p > above else "free" if p < below else "unknown"


@given(grey=GREYS, thresholds=st.tuples(SHARES, SHARES), negate=st.booleans(), plain=st.booleans())
def test_a_grey_cell_is_what_the_thresholds_say(
    grey: np.ndarray, thresholds: tuple[float, float], negate: bool, plain: bool
) -> None:
    below, above = sorted(thresholds)
    found = occupancy(pgm(grey, b"P2" if plain else b"P5"), occupied_above=above, free_below=below, negate=negate)
    for (row, column), x in np.ndenumerate(grey[::-1]):  # the lowest row comes last in the file
        kind = "occupied" if found.occupied[row, column] else "unknown" if found.unknown[row, column] else "free"
        assert kind == kind_of(int(x), True, above, below, negate), x
    assert not np.any(found.occupied & found.unknown)


@given(colours=COLOURS)
def test_a_coloured_cell_counts_by_its_mean_and_a_transparent_one_is_unknown(colours: np.ndarray) -> None:
    found = occupancy(png(Image.fromarray(colours)), occupied_above=0.65, free_below=0.25)
    for row, column in np.ndindex(found.occupied.shape):
        *rgb, alpha = colours[::-1][row, column].tolist()
        kind = kind_of(sum(rgb) / 3, alpha == 255, 0.65, 0.25, False)
        assert (found.occupied[row, column], found.unknown[row, column]) == (kind == "occupied", kind == "unknown")


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
def test_black_is_occupied_and_white_is_free_in_every_kind_of_image(mode: str) -> None:
    image = Image.new("L", (2, 1))
    image.putpixel((1, 0), 255)
    deep = np.array([[0, 65535]], np.uint16)
    data = png(Image.fromarray(deep) if mode == "I;16" else image.convert(mode))
    found = occupancy(data, occupied_above=0.65, free_below=0.25)
    assert (found.occupied.tolist(), found.unknown.tolist()) == ([[True, False]], [[False, False]])


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "not a PGM"),
        (b"P7\n1 1\n255\n\0", "not a PGM"),
        (b"GIF89a", "not a PGM"),
        (b"P5\n0 1\n255\n", "not a PGM"),
        (b"P5\n-1 4\n255\n\0\0\0\0", "not a PGM"),
        (b"P5\n2 nan\n255\n\0\0", "a broken image"),
        (b"P5\n2 2\n255\n\0\0\0", "a broken image"),
        (b"P2\n2 2\n255\n0 0 0", "a broken image"),
        (b"P5\n999999999 999999999\n255\n\0", f"more than {MOST_CELLS} cells"),
        (b"P5\n4001 4000\n255\n\0", f"more than {MOST_CELLS} cells"),
        (png(Image.new("L", (64, 64)))[:60], "a broken image"),
        (png(Image.new("1", (4001, 4000))), f"more than {MOST_CELLS} cells"),
    ],
)
def test_an_image_that_cannot_be_used_is_refused(data: bytes, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        occupancy(data, occupied_above=0.65, free_below=0.25)
