"""A recording on its way into a file: columns in field units."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.formats.statement import ROLES, vocabulary
from sagnac.recording.frames import NULL_PULSE_NAME, TEMPERATURE
from sagnac.recording.model import Kind, Recording
from sagnac.recording.pickoff import PICKOFF

Rows = dict[str, NDArray[Any]]

# Each recording that is written says so, in whatever its format has for remarks.
MADE: Final = "recording made by sagnac"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outgoing:
    """A recording in field units, ready for any format.

    Attributes
    ----------
    columns
        Name -> (samples,) values in SI: ``time`` where sampling is not uniform, the gyros, the
        accelerometers, ``table``, ``null_pulse`` (bool), and the pick-offs as they are.
    units
        Name -> unit to write in; ``null_pulse`` and pick-offs have none.
    sizes
        Name -> SI size of that unit.
    kinds
        Name of a gyro or an accelerometer -> kind.
    sample_rate
        Hz.
    accelerometers
        Which of `kinds` are accelerometers.
    """

    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str]
    sizes: Mapping[str, float]
    kinds: Mapping[str, Kind]
    sample_rate: float
    accelerometers: tuple[str, ...] = ()

    @property
    def sensors(self) -> dict[str, str]:
        """``gyros`` and, if there are any, ``accelerometers``: names with commas between."""
        gyros = ",".join(name for name in self.kinds if name not in self.accelerometers)
        forces = {"accelerometers": ",".join(self.accelerometers)} if self.accelerometers else {}
        return {"gyros": gyros, **forces}

    @property
    def samples(self) -> int:
        """Number of samples."""
        return next(iter(self.columns.values())).size

    def rows(self, block: slice) -> Rows:
        """Name -> values of a block in `units`; the null pulse is 0 or 1."""
        return {
            name: values[block] / self.sizes[name]
            if name in self.sizes
            else values[block].astype(np.uint8 if name == NULL_PULSE_NAME else np.float64)
            for name, values in self.columns.items()
        }

    def write_blocks(
        self, write: Callable[[int, Rows], None], *, length: int | None = None
    ) -> None:
        """Hand all rows to a format that grows, block by block.

        Parameters
        ----------
        write
            Called with the number of the first row, and with `rows`.
        length
            Rows in a block, `series.SPAN` unless stated.
        """

        def step(state: None, block: slice) -> None:
            write(block.start, self.rows(block))

        series.reduce(step, None, self.samples, *self.columns.values(), length=length)

    def statement(self) -> dict[str, str | float]:
        """All of it in flat text, for formats that carry attributes beside the numbers."""
        return {
            **self.sensors,
            "kind": ",".join(f"{name}={kind}" for name, kind in self.kinds.items()),
            "unit": ",".join(f"{name}={unit}" for name, unit in self.units.items()),
            "sample_rate": self.sample_rate,
        }


def outgoing(recording: Recording) -> Outgoing:
    """`recording` in the units its channels came in, or the field's.

    Raises
    ------
    ValueError
        If a gyro carries a name that a file needs for something else.
    """
    columns: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    sizes: dict[str, float] = {}
    if recording.times is not None:
        columns["time"], units["time"], sizes["time"] = recording.times, "s", 1.0
    sensors = (*recording.gyros, *recording.accelerometers)
    for channel in sensors:
        check_name(channel.name)
    named = {channel.name: channel for channel in sensors}
    if recording.table is not None:
        named["table"] = recording.table
    for name, channel in named.items():
        unit = channel.plain_unit
        columns[name], units[name], sizes[name] = channel.values, unit.name, unit.size
    if recording.null_pulse is not None:
        columns[NULL_PULSE_NAME] = recording.null_pulse
    columns.update({one.column: one.values for one in recording.pickoffs})
    if recording.temperature is not None:
        columns[TEMPERATURE] = recording.temperature
    return Outgoing(
        columns=columns,
        units=units,
        sizes=sizes,
        kinds={channel.name: channel.kind for channel in sensors},
        sample_rate=recording.sample_rate,
        accelerometers=tuple(one.name for one in recording.accelerometers),
    )


def check_name(name: str) -> None:
    """Refuse a gyro name that cannot stand in a file.

    Raises
    ------
    ValueError
        If it is empty, reserved, or holds a mark that files use.
    """
    reserved = name in ROLES or name in vocabulary()
    reserved = reserved or name.startswith(PICKOFF) or name == TEMPERATURE
    odd = set(name) & set(",;=[]:\"'#%") or not name.isprintable() or name != name.strip()
    # A spreadsheet computes what begins with one of the last three.
    if not name or reserved or odd or name.startswith(("_", "+", "-", "@")):
        raise ValueError(
            f"gyro name is {name!r}, which cannot stand in a file; choose another without "
            "quotes, brackets, separators or a leading underscore, sign or @, and none that a file "
            "states something by, such as time, kind or unit"
        )
