"""What the second simulator makes, as a recording of the package."""

from collections.abc import Iterable

from sagnac import Recording
from tests.second_rig import Simulated


def recorded(made: Simulated, names: Iterable[str] = ("x", "y", "z")) -> Recording:
    """A recording of the gyros of these names beside the table's encoder."""
    return Recording.from_arrays(
        **{name: made.angles[name] for name in names},
        kind="angle",
        unit="rad",
        sample_rate=made.sample_rate,
        table=made.table,
        table_unit="rad",
    )
