"""What the second simulator makes, as a recording of the package, and what is said of it."""

from collections.abc import Iterable

from sagnac import Analysis, Recording
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


# What an encoder may be said to be, each in the words of its note.
CAUSES = {
    "delay": "they are shifted",
    "runs-off": "its angle runs off",
    "latch": "as if latched",
    "wander": "its readings wander",
    "held": "held between",
    "lost": "missing samples",
}


def causes(analysis: Analysis) -> set[str]:
    """Errors of the encoder that the notes name."""
    texts = [note.text for note in analysis.notes if note.channel == "table"]
    return {cause for cause, said in CAUSES.items() if any(said in text for text in texts)}
