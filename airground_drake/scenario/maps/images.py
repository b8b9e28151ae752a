"""Images of maps as ROS writes them: which cells are occupied, free or unknown."""

import io
import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from airground_drake.base.errors import short
from airground_drake.scenario.maps.rectangles import MOST_CELLS, Cells

FORMATS = ("PPM", "PNG", "BMP")  # Pillow counts PGM to PPM
WHITE = 3 * 255
# Brightness of cells that `map_saver` leaves unknown. With its own free_thresh of 0.25 they would count as free.
UNKNOWN = 3 * 205
_DEEP = ("I", "I;16", "I;16B", "I;16L", "I;16N")  # Pillow's modes of images with 16 bits per cell


class Occupancy(NamedTuple):
    """Which cells are occupied and which are unknown, (rows, columns), the lowest row first. The others are free."""

    occupied: Cells
    unknown: Cells


def occupancy(data: bytes, *, occupied_above: float, free_below: float, negate: bool = False) -> Occupancy:
    """The cells in an image by ROS's mode "trinary"."""
    # The probability p that a cell is occupied is (255 - x) / 255 for its brightness x, the mean of red, green and
    # blue; with `negate`, x / 255. A cell that is transparent in the least, or of grey 205, is unknown whatever p is.
    # With `negate` so is grey 50, which has the p that grey 205 has without.
    # free_below: a cell with a smaller p is free; those between are unknown.
    brightness, opaque = _decoded(data)
    weights = np.arange(WHITE + 1) if negate else WHITE - np.arange(WHITE + 1)  # p of each brightness, times WHITE
    is_occupied = weights > occupied_above * WHITE
    is_unknown = ~is_occupied & ~(weights < free_below * WHITE) | (weights == WHITE - UNKNOWN)
    is_unknown[UNKNOWN] = True
    unknown = is_unknown[brightness] | ~opaque
    return Occupancy(is_occupied[brightness] & ~unknown, unknown)


def _decoded(data: bytes) -> tuple[NDArray[np.uint16], Cells]:
    """Sum of red, green and blue of each cell, 0 to WHITE, and whether it is opaque; the lowest row first."""
    # A brightness of 16 bits is rounded down to 8 bits.
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # counted here
            with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                if image.width * image.height > MOST_CELLS:
                    raise Image.DecompressionBombError
                if image.mode in _DEEP:
                    channels = (np.asarray(image, np.int64) // 257).astype(np.uint8)[..., None].repeat(3, axis=2)
                else:
                    channels = np.asarray(image.convert("RGBA" if image.has_transparency_data else "RGB"))
    except UnidentifiedImageError:
        raise ValueError("not a PGM, PPM, PNG or BMP image") from None
    except Image.DecompressionBombError:
        raise ValueError(f"an image of more than {MOST_CELLS} cells") from None
    except Exception as error:  # Pillow raises many kinds
        raise ValueError(f"a broken image ({short(str(error) or type(error).__name__)})") from None
    channels = channels[::-1]
    opaque = channels[..., 3] == 255 if channels.shape[2] == 4 else np.ones(channels.shape[:2], bool)
    return channels[..., :3].sum(axis=2, dtype=np.uint16), opaque
