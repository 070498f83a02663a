"""Self-noise as text and figure."""

import numpy as np

import sagnac
from sagnac.report import text
from sagnac.report.figures import self_noise_figure


def test_each_gyro_has_its_row_and_its_curve():
    noise = np.random.default_rng(5).standard_normal((4, 8000))
    channels = dict(zip("xyz", 30.0 * noise[3] + noise[:3], strict=True))
    still = sagnac.Recording.from_arrays(**channels, kind="rate", unit="deg/h", sample_rate=10.0)
    found = sagnac.self_noise(still, band=(0.1, 5.0))
    said = text.self_noise(found, (0.1, 5.0)).splitlines()
    assert said[0] == "Self-noise from the cross spectra of 3 gyros, 0.1 to 5 Hz"
    assert [row.split()[0] for row in said[-3:]] == ["x", "y", "z"]
    assert all("°/√h" in row for row in said[-3:])
    (axes,) = self_noise_figure(found).axes
    assert [line.get_label() for line in axes.get_lines()][:4] == ["what all share", "x", "y", "z"]
