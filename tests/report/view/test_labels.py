"""Labels of maps keep clear of marks, of lines and of each other where there is room."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.path import Path

from airground_drake.report.view import canvas
from airground_drake.report.view.labels import Label, place


@pytest.mark.parametrize("seed", range(3))
def test_labels_cover_no_mark_no_line_and_no_other_label(seed: int) -> None:
    random = np.random.default_rng(seed)
    with canvas.style():
        figure = Figure(figsize=(2.2, 2.2))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, 10.0), ylim=(0.0, 10.0))
        at = random.uniform(2.0, 8.0, (5, 2))
        wall = np.array([[1.0, 1.0], [9.0, 9.0]])
        place(axes, [Label(each, f"ugv{k}") for k, each in enumerate(at)], [wall])
        figure.draw_without_rendering()
        boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) == len(at)
    assert not any(box.padded(4.0).contains(*axes.transData.transform(each)) for box in boxes for each in at)
    assert not any(Path(axes.transData.transform(wall)).intersects_bbox(box, filled=False) for box in boxes)
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])
