"""The numbers that the paper prints."""

from collections.abc import Mapping
from typing import Final

PAIR: Final = ("x", "z")
# Figures as published, deg/sqrt(h). Figure 3 is by interval in s, the tables are by
# table rate in deg/s, for three days.
FIGURE_2: Final = 0.0498
FIGURE_3: Final[Mapping[float, float]] = {1.0: 2.5006e-4, 6.0: 3.3011e-3, 12.0: 4.5305e-3}
TABLE_1: Final[Mapping[float, tuple[float, ...]]] = {
    0.0: (3.6427e-4, 3.3709e-4, 3.7997e-4),
    10.0: (3.3903e-4, 3.4392e-4, 3.0869e-4),
    20.0: (4.2517e-4, 3.1152e-4, 3.6555e-4),
    30.0: (3.4121e-4, 3.2906e-4, 4.1709e-4),
    40.0: (3.4328e-4, 6.5700e-4, 4.5071e-4),
}
TABLE_2: Final[Mapping[float, tuple[float, ...]]] = {
    10.0: (8.3297e-5, 4.6176e-5, 6.8846e-5),
    20.0: (6.7278e-5, 2.6117e-5, 3.2470e-5),
    40.0: (7.4707e-5, 2.3985e-5, 2.3238e-5),
    60.0: (2.1993e-5, 2.9396e-5, 2.5313e-5),
    80.0: (3.4774e-5, 2.3414e-5, 2.6234e-5),
}
