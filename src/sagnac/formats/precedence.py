"""The three statements about a file, and which of them is heard."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from sagnac.formats.statement import Statement, of_name
from sagnac.recording.frames import TEMPERATURE
from sagnac.recording.pickoff import PICKOFF

# Names of columns that are no gyros.
_PLACES: Final = ("table", "time", "null_pulse", TEMPERATURE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Statements:
    """Statements of caller, TOML and file, heard in this order.

    Attributes
    ----------
    caller, beside, file
        The statements; those that are not there state nothing.
    """

    caller: Statement = field(default_factory=Statement)
    beside: Statement = field(default_factory=Statement)
    file: Statement = field(default_factory=Statement)

    @property
    def in_order(self) -> tuple[Statement, Statement, Statement]:
        """The one heard first comes first."""
        return self.caller, self.beside, self.file

    @property
    def sample_rate(self) -> float | None:
        """Hz, or None where none is stated."""
        rate: float | None = self._first("sample_rate")
        return rate

    @property
    def scale(self) -> str | None:
        """Size of one count, or None where none is stated."""
        scale: str | None = self._first("scale")
        return scale

    @property
    def counter_period(self) -> float | None:
        """Counts after which gyro counters start over, or None where nothing is stated."""
        for statement in self.in_order:
            if statement.counter_period is not None:
                return float(statement.counter_period)
            if statement.counter_bits is not None:
                return 2.0**statement.counter_bits
        return None

    @property
    def layout(self) -> str | Mapping[str, Any] | None:
        """How the records of a binary file are laid out, or None where none is stated."""
        layout: str | Mapping[str, Any] | None = self._first("layout")
        return layout

    @property
    def gyros(self) -> tuple[str, ...]:
        """Names of the gyros wanted by the first that names any; empty where none does."""
        for statement in self.in_order:
            names = statement.gyros or tuple(
                name
                for name in statement.columns
                if name not in (*_PLACES, *self.accelerometers) and not name.startswith(PICKOFF)
            )
            if names:
                return names
        return ()

    @property
    def accelerometers(self) -> tuple[str, ...]:
        """Names of the accelerometers wanted by the first that says so; empty if there are none."""
        names: tuple[str, ...] = self._first("accelerometers") or ()
        return () if names == ("none",) else names

    def of_accelerometer(self, quantity: str, name: str) -> str | None:
        """Statement of ``kind`` or ``unit`` of an accelerometer, or None.

        By name, or for all of them under ``accelerometers``; what is stated for all channels is
        that of the gyros.
        """
        for statement in self.in_order:
            stated = getattr(statement, quantity)
            if stated is not None and not isinstance(stated, str):
                found: str | None = stated.get(name, stated.get("accelerometers"))
                if found is not None:
                    return found
        return None

    def column(self, name: str) -> str | None:
        """The file's name for `name`, or None where none gives one."""
        for statement in self.in_order:
            if name in statement.columns:
                return statement.columns[name]
        return None

    def role(self, role: str) -> str | None:
        """Statement of ``time``, ``table`` or ``null_pulse``, or None."""
        return self._first(role) or self.column(role)

    def own_unit(self, name: str) -> str | None:
        """The unit stated for `name` alone; one for all gyros does not count."""
        for statement in self.in_order:
            unit = statement.unit
            if unit is not None and not isinstance(unit, str) and name in unit:
                return unit[name]
        return None

    def gyro(self, quantity: str, name: str) -> str | None:
        """Statement by caller or TOML of ``kind`` or ``unit`` of a gyro, or None."""
        for statement in (self.caller, self.beside):
            stated = of_name(getattr(statement, quantity), name)
            if stated is not None:
                return stated
        return None

    def gyro_by_file(self, quantity: str, name: str) -> str | None:
        """Statement by the file of ``kind`` or ``unit`` of a gyro, or None."""
        return of_name(getattr(self.file, quantity), name)

    def _first(self, name: str) -> Any:
        stated = (getattr(statement, name) for statement in self.in_order)
        return next((value for value in stated if value is not None), None)
