"""The sensors of an analysis, as keys of the rig."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Self

from sagnac.core.texts import by_axis
from sagnac.core.units import SENSED, SENSORS, UNITS, Sensor, field_unit
from sagnac.rig.sections import SENSOR_KEYS, SENSOR_NAMES

_SHOWN: Final = ("step", "range")
_MARKOV: Final = ("markov", "second_markov")


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredSensor:
    """One sensor of an analysis.

    Attributes
    ----------
    coefficients
        Coefficient -> its value in the field's unit; what was not estimated is not there.
    low_pass
        Corner, Hz, and order of the low-pass that its spectrum shows; None if it shows none.
    markov
        Standard deviation in the field's unit and correlation time, s, of each of at most two
        Markov rates.
    readout
        ``step`` and ``range`` of its samples, those that they show, and their ``unit``.
    """

    coefficients: Mapping[str, float]
    low_pass: tuple[float, int] | None = None
    markov: tuple[tuple[float, float], ...] = ()
    readout: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of_document(cls, stated: Mapping[str, Any], name: str, kind: Sensor) -> Self:
        """The sensor, or pair, called `name`; a pair has the readout of its first gyro.

        B and K that are bounds come from the slow noise that the spectrum shows.
        """
        keys, slow = SENSED[kind].keys, stated.get("slow_noise") or {}
        given = stated["coefficients"]
        measured = {coefficient: given.get(key) for coefficient, key in keys.items()}
        measured["angle_random_walk"] = stated[keys["angle_random_walk"]]
        shows = {one: slow[key]["value"] for one, key in keys.items() if key in slow}
        known = [(key, one) for key, one in measured.items() if one is not None]
        estimated = {key: one["value"] for key, one in known if one["status"] == "estimated"}
        low_pass, readouts = stated.get("low_pass"), stated.get("readout") or {name: {}}
        passing = (low_pass["corner_hz"], low_pass["order"]) if low_pass else None
        rates = [slow[key] for key in _MARKOV if slow.get(key)]
        times = [one["correlation_time_s"]["value"] for one in rates]
        markov = tuple(zip([one["deviation"]["value"] for one in rates], times, strict=True))
        put_in = {one: value for one, value in shows.items() if value > 0.0} | estimated
        readout = readouts.get(name) or next(iter(readouts.values()))
        return cls(coefficients=put_in, low_pass=passing, markov=markov, readout=readout)

    def keys(self, kind: Sensor, interval: float) -> dict[str, float]:
        """Keys of the rig for one axis, each with its value; `interval` is that of samples, s.

        N and Q were measured with what the steps of a readout add: a step D of a rate adds D^2/12
        times the time of a sample to N^2, and one of an angle D^2/12 to Q^2. If N is less than the
        step of a rate would make it, an angle was counted.
        """
        units = {error: field_unit(own, kind).size for error, own, *_ in SENSOR_KEYS}
        stated = {error: self.coefficients.get(own, 0.0) for error, own, *_ in SENSOR_KEYS}
        measured = ("angle_noise", "random_walk", "instability", "rate_walk", "ramp")
        errors = {error: one if error in measured else 0.0 for error, one in stated.items()}
        keys = {"low_pass_hz": self.low_pass[0] if self.low_pass else 0.0}
        for place, which in enumerate(_MARKOV):
            # A Markov rate that is not there has any correlation time.
            rates = self.markov[place : place + 1] or ((0.0, 100.0),)
            errors[f"{which}_deviation"], keys[f"{which}_time_s"] = rates[0]
        rate_unit = SENSED[kind].rate_unit
        unit = self.readout.get("unit", rate_unit)
        step, end = (self.readout.get(what, 0.0) * UNITS[unit].size for what in _SHOWN)
        errors["full_scale"] = end / (1.0 if unit == rate_unit else interval) / units["full_scale"]
        walk, noise = (errors[one] * units[one] for one in ("random_walk", "angle_noise"))
        added = step**2 / 12.0 * interval
        if unit == rate_unit and added <= walk**2:
            errors["rate_quantum"] = step / units["rate_quantum"]
            errors["random_walk"] = math.sqrt(walk**2 - added) / units["random_walk"]
        else:
            counted = step * interval if unit == rate_unit else step
            rest = math.sqrt(max(noise**2 - counted**2 / 12.0, 0.0))
            errors["quantum"] = counted / units["quantum"]
            errors["angle_noise"] = rest / units["angle_noise"]
        place = SENSORS.index(kind)
        return keys | {own[place]: errors[error] for error, _, *own in SENSOR_KEYS}


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """The sensors of one analysis.

    Attributes
    ----------
    sensors
        Kind -> name -> sensor; a kind that there is none of is not there.
    recorded
        ``input`` of the document: how it was sampled, and how the table turned.
    """

    sensors: Mapping[Sensor, Mapping[str, MeasuredSensor]]
    recorded: Mapping[str, Any]

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Self:
        """The sensors of a document of schema ``sagnac.analysis/1``.

        A triad on a table has only N of each gyro; all else is that of the pair.
        """
        gyros = document.get("gyros") or {document["channel"]: document}
        forces = document.get("accelerometers") or {}
        stated: dict[Sensor, Mapping[str, Any]] = {"gyro": gyros, "accelerometer": forces}
        sensors = {
            kind: {name: MeasuredSensor.of_document(one, name, kind) for name, one in each.items()}
            for kind, each in stated.items()
            if each
        }
        if not document.get("gyros"):
            (pair,) = sensors["gyro"].values()
            readouts, alone = document.get("readout") or {}, {}
            for name, own in document["per_gyro"].items():
                if own["status"] == "estimated":
                    put_in = {**pair.coefficients, "angle_random_walk": own["value"]}
                    alone[name] = replace(pair, coefficients=put_in, readout=readouts.get(name, {}))
            sensors["gyro"] = alone or sensors["gyro"]
        return cls(sensors=sensors, recorded=document["input"])

    def keys(self) -> dict[str, Any]:
        """Nested tables of a `RigConfig`."""
        table_rate = self.recorded.get("table_rate_deg_per_s") or 0.0
        tables: dict[str, dict[str, Any]] = {"table": {"rate_deg_per_s": table_rate}}
        alone = {key: self.recorded[key] for key in ("duration_s", "sample_rate_hz")}
        if self.recorded.get("kind"):
            alone["kind"] = self.recorded["kind"]
        for kind, sensors in self.sensors.items():
            three = _three(sensors)
            each = [one.keys(kind, 1.0 / alone["sample_rate_hz"]) for one in three]
            # The rig has one order for all: that of the lowest corner.
            passes = [one.low_pass for one in three if one.low_pass]
            order = {"low_pass_order": min(passes, default=(0.0, 1))[1]}
            tables[kind] = order | {key: [axis[key] for axis in each] for key in each[0]}
        if "accelerometer" in tables:
            tables["accelerometer"]["mode"] = "triad"
        return {**alone, **tables}

    def left_out(self) -> list[str]:
        """Low-passes and readouts, and what is not simulated as it was measured, a line each."""
        each = [one for sensors in self.sensors.values() for one in sensors.items()]
        passes = [(name, *one.low_pass) for name, one in each if one.low_pass]
        lines = [f"{name}: low-pass of {hz:.4g} Hz, order {order}" for name, hz, order in passes]
        lines = lines or ["no low-pass, since the spectrum shows none"]
        lines += [
            f"{name}: readout {what} of {one.readout[what]:.4g} {one.readout['unit']}"
            for name, one in each
            for what in _SHOWN
            if what in one.readout
        ]
        for kind, sensors in self.sensors.items():
            for name, one in sensors.items():
                lines += [
                    f"{name}: Markov rate of {size:.4g} {SENSED[kind].rate_unit} over {time:.4g} s"
                    for size, time in one.markov
                ]
                titles = SENSED[kind].titles.items()
                missing = [title for key, title in titles if key not in one.coefficients]
                if missing:
                    lines.append(f"{name}: without {', '.join(missing)}, not estimated")
            if len({one.low_pass[1] for one in sensors.values() if one.low_pass}) > 1:
                lines.append(f"low-passes of the {kind}s: of one order, as the rig has them")
            told = by_axis(sensors)
            others = [name for name in SENSOR_NAMES[kind] if name[-1] not in told]
            if others and (told or len(sensors) != 3):
                lines.append(f"{', '.join(others)}: as {next(iter(sensors))}")
        lines.append("no mean: neither its biases nor how it stood, which are those of the table")
        return lines


def _three(sensors: Mapping[str, MeasuredSensor]) -> list[MeasuredSensor]:
    """Sensors of the three axes: by name, three in order if no name tells, else the first."""
    first, *others = sensors.values()
    told = by_axis(sensors)
    if len(others) == 2 and not told:
        return [first, *others]
    return [told.get(axis, first) for axis in "xyz"]
