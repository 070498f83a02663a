"""Figure 1: the frames as they are seen."""

import numpy as np
import pytest
from matplotlib.text import Annotation

from sagnac.report.figures import frames_figure, seen


def test_what_is_seen_is_a_rotation_without_its_depth():
    """Across and up are rows of a rotation: unit length, orthogonal."""
    axes = seen(np.eye(3))
    assert (axes**2).sum(axis=0) == pytest.approx([1.0, 1.0])
    assert axes[:, 0] @ axes[:, 1] == pytest.approx(0.0, abs=1e-12)
    assert axes[2, 1] < 0.0  # down is down
    # From above, east lies clockwise of north.
    assert axes[0, 0] * axes[1, 1] - axes[0, 1] * axes[1, 0] < 0.0


def test_every_axis_is_named_and_the_gyros_stand_around_the_shaft():
    (axes,) = frames_figure().axes
    labels = {
        text.get_text(): np.array(text.xyann)
        for text in axes.texts
        if isinstance(text, Annotation) and text.get_text()
    }
    assert {"$x_s$", "$y_s$", "$z_s$", "$x_b$", "$y_b$", "$x_{b0}$, null"} < set(labels)
    # Equal shares: the sum of the three sensitive axes points along the shaft.
    total = labels["$x_s$"] + labels["$y_s$"] + labels["$z_s$"]
    shaft = labels["$z_b$, $z_n$ down, shaft"]
    assert total == pytest.approx(np.sqrt(3.0) * shaft, abs=1e-9)
