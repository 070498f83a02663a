"""The published numbers are those of the paper."""

import numpy as np

from sagnac.paper.prediction import FIGURE_2, FIGURE_3, TABLE_1, TABLE_2
from tests.paper.scope import RATES


def test_published_numbers_are_those_of_the_paper():
    assert FIGURE_2 == 0.0498
    assert tuple(FIGURE_3.items()) == ((1.0, 2.5006e-4), (6.0, 3.3011e-3), (12.0, 4.5305e-3))
    rows_1 = """3.6427 3.3903 4.2517 3.4121 3.4328
                3.3709 3.4392 3.1152 3.2906 6.5700
                3.7997 3.0869 3.6555 4.1709 4.5071"""
    rows_2 = """8.3297 6.7278 7.4707 2.1993 3.4774
                4.6176 2.6117 2.3985 2.9396 2.3414
                6.8846 3.2470 2.3238 2.5313 2.6234"""
    for table, rows, size in ((TABLE_1, rows_1, 1e-4), (TABLE_2, rows_2, 1e-5)):
        by_day = np.array(rows.split(), float).reshape(3, 5) * size
        np.testing.assert_allclose(np.array(list(table.values())).T, by_day, rtol=1e-12)
    assert tuple(TABLE_1) == RATES["table1"]
    assert tuple(TABLE_2) == RATES["table2"]
