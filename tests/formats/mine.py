"""A reader of another package: a number a line, rad/s at 10 Hz."""

import numpy as np

from sagnac.formats.source import Source, column, in_memory
from sagnac.formats.statement import Statement


def open_source(path):
    values = np.loadtxt(path)
    return Source(
        format="Mine",
        columns=(column("x[rad/s]", kind="rate"),),
        stated=Statement(sample_rate=10.0),
        load=lambda keys: in_memory({key: values.copy() for key in keys}),
    )
