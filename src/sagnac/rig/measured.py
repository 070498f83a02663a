"""The sensors of an analysis, as keys of the rig."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Self

from sagnac.core.units import SENSED, SENSORS, UNITS, Sensor, field_unit
from sagnac.rig.sections import ACCELEROMETER_NAMES, GYRO_NAMES, SENSOR_KEYS

# Errors whose coefficients are measured.
_MEASURED: Final = ("angle_noise", "random_walk", "instability", "rate_walk", "ramp")
# By kind of sensor: coefficient -> its key, whose unit is the field's own.
_KEYS: Final[Mapping[Sensor, Mapping[str, str]]] = {
    sensor: {
        coefficient: keys[place] for name, coefficient, *keys in SENSOR_KEYS if name in _MEASURED
    }
    for place, sensor in enumerate(SENSORS)
}
_READ_OUT: Final = ("quantum", "rate_quantum", "full_scale")
_NOISES: Final = ("random_walk", "angle_noise")
_SHOWN: Final = ("step", "range")
_FORCE_WALK: Final = "velocity_random_walk"
_MARKOV_TIME_S: Final = 100.0  # of a Markov rate that is not there
_NAMES: Final[Mapping[Sensor, tuple[str, str, str]]] = {
    "gyro": GYRO_NAMES,
    "accelerometer": ACCELEROMETER_NAMES,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """The sensors of one analysis.

    Attributes
    ----------
    sensors
        Kind -> name -> coefficient -> its value in the field's unit; what was not estimated is not
        there, and neither is a kind that there is none of.
    sample_rate, duration
        Hz and s.
    kind
        Of a sample; empty if it is not stated.
    low_passes
        Name -> corner, Hz, and order of the low-pass that its spectrum shows.
    markov
        Name -> standard deviation in the field's unit and correlation time, s, of each of at most
        two Markov rates.
    readouts
        Name -> ``step`` and ``range`` of its samples, those that they show, and their ``unit``.
    table_rate
        deg/s, 0 at rest.
    """

    sensors: Mapping[Sensor, Mapping[str, Mapping[str, float]]]
    sample_rate: float
    duration: float
    table_rate: float = 0.0
    kind: str = ""
    low_passes: Mapping[str, tuple[float, int]] = field(default_factory=dict)
    markov: Mapping[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    readouts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Self:
        """The sensors of a document of schema ``sagnac.analysis/1``."""
        read = document["input"]
        alone = document.get("gyros") or {document["channel"]: document}
        gyros = {
            name: _of_document(one, one["angle_random_walk"], "gyro") for name, one in alone.items()
        }
        if not document.get("gyros"):
            # A triad on a table has only N of each gyro; the other terms are those of the pair.
            (pair,) = gyros.values()
            gyros = {
                name: {**pair, **_of_document({"coefficients": {}}, own, "gyro")}
                for name, own in document["per_gyro"].items()
                if own["status"] == "estimated"
            } or gyros
        forces = {
            name: _of_document(one, one[_FORCE_WALK], "accelerometer")
            for name, one in (document.get("accelerometers") or {}).items()
        }
        stated = {**alone, **(document.get("accelerometers") or {})}.items()
        return cls(
            sensors={"gyro": gyros, **({"accelerometer": forces} if forces else {})},
            sample_rate=read["sample_rate_hz"],
            duration=read["duration_s"],
            table_rate=read.get("table_rate_deg_per_s") or 0.0,
            kind=read.get("kind") or "",
            low_passes={
                name: (one["low_pass"]["corner_hz"], one["low_pass"]["order"])
                for name, one in stated
                if one.get("low_pass")
            },
            markov={
                name: tuple(
                    (rate["deviation"]["value"], rate["correlation_time_s"]["value"])
                    for key in ("markov", "second_markov")
                    if (rate := one.get("slow_noise", {}).get(key))
                )
                for name, one in stated
            },
            readouts={
                each: shown for name, one in stated for each, shown in _readouts(name, one).items()
            },
        )

    def keys(self) -> dict[str, Any]:
        """Nested tables of a `RigConfig`."""
        tables: dict[str, dict[str, Any]] = {}
        for kind, found in self.sensors.items():
            names = _three(found, _NAMES[kind])
            table = tables[kind] = {
                key: [found[name].get(coefficient, 0.0) for name in names]
                for coefficient, key in _KEYS[kind].items()
            }
            passes = [self.low_passes.get(name, (0.0, 1)) for name in names]
            table["low_pass_hz"] = [corner for corner, _ in passes]
            # The rig has one order for all: that of the lowest corner.
            table["low_pass_order"] = min((one for one in passes if one[0]), default=(0.0, 1))[1]
            unit = {"gyro": "deg_per_h", "accelerometer": "mg"}[kind]
            for place, which in enumerate(("", "second_")):
                rates = [
                    dict(enumerate(self.markov.get(name, ()))).get(place, (0.0, _MARKOV_TIME_S))
                    for name in names
                ]
                sizes, times = zip(*rates, strict=True)
                table[f"{which}markov_deviation_{unit}"] = list(sizes)
                table[f"{which}markov_time_s"] = list(times)
            self._read_out(table, kind, names)
        if "accelerometer" in tables:
            tables["accelerometer"]["mode"] = "triad"
        return {
            "duration_s": self.duration,
            "sample_rate_hz": self.sample_rate,
            **({"kind": self.kind} if self.kind else {}),
            "table": {"rate_deg_per_s": self.table_rate},
            **tables,
        }

    def _read_out(self, table: dict[str, Any], kind: Sensor, names: list[str]) -> None:
        """Put steps and ranges into the keys of a kind of sensor.

        N and Q were measured with what the steps add: a step D of a rate adds D^2/12 times the
        time of a sample to N^2, and one of an angle D^2/12 to Q^2. If N is less than the step of a
        rate would make it, an angle was counted.
        """
        place, interval = SENSORS.index(kind), 1.0 / self.sample_rate
        keys = {
            error: (own[place], field_unit(coefficient, kind).size)
            for error, coefficient, *own in SENSOR_KEYS
        }
        table.update({keys[error][0]: [0.0] * len(names) for error in _READ_OUT})

        def put(error: str, axis: int, value: float) -> None:
            key, unit = keys[error]
            table[key][axis] = value / unit

        for axis, name in enumerate(names):
            shown = self.readouts.get(name, {"unit": SENSED[kind].rate_unit})
            of_rate = shown["unit"] == SENSED[kind].rate_unit
            step, end = (shown.get(what, 0.0) * UNITS[shown["unit"]].size for what in _SHOWN)
            put("full_scale", axis, end if of_rate else end / interval)
            walk, noise = (
                table[key][axis] * unit for key, unit in (keys[each] for each in _NOISES)
            )
            added = step**2 / 12.0 * interval
            if of_rate and added <= walk**2:
                put("rate_quantum", axis, step)
                put("random_walk", axis, math.sqrt(walk**2 - added))
            else:
                counted = step * interval if of_rate else step
                put("quantum", axis, counted)
                put("angle_noise", axis, math.sqrt(max(noise**2 - counted**2 / 12.0, 0.0)))

    def left_out(self) -> list[str]:
        """Low-passes and readouts, and what is not simulated as it was measured, a line each."""
        lines = [
            f"{name}: low-pass of {corner:.4g} Hz, order {order}"
            for name, (corner, order) in self.low_passes.items()
        ] or ["no low-pass, since the spectrum shows none"]
        lines += [
            f"{name}: readout {what} of {shown[what]:.4g} {shown['unit']}"
            for name, shown in self.readouts.items()
            for what in _SHOWN
            if what in shown and any(name in found for found in self.sensors.values())
        ]
        for kind, found in self.sensors.items():
            titles = SENSED[kind].titles
            for name, one in found.items():
                lines += [
                    f"{name}: Markov rate of {size:.4g} {SENSED[kind].rate_unit} over {time:.4g} s"
                    for size, time in self.markov.get(name, ())
                ]
                missing = [title for key, title in titles.items() if key not in one]
                if missing:
                    lines.append(f"{name}: without {', '.join(missing)}, not estimated")
            orders = {self.low_passes[name][1] for name in found if name in self.low_passes}
            if len(orders) > 1:
                lines.append(f"low-passes of the {kind}s: of one order, as the rig has them")
            others = [name for name in _NAMES[kind] if name not in found]
            if others and len(found) != 3:
                lines.append(f"{', '.join(others)}: as {next(iter(found))}")
        lines.append("no mean: neither its biases nor how it stood, which are those of the table")
        return lines


def _three(found: Mapping[str, object], names: tuple[str, str, str]) -> list[str]:
    """Names of the sensors for the three axes: by name, in order if none fits, else the first."""
    if len(found) == 3 and not set(names) & set(found):
        return list(found)
    first = next(iter(found))
    return [name if name in found else first for name in names]


def _readouts(name: str, stated: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Readouts of a document by sensor; a pair has that of its first gyro."""
    shown = dict(stated.get("readout", {}))
    return {**shown, name: next(iter(shown.values()))} if shown else {}


def _of_document(
    stated: Mapping[str, Any], walk: Mapping[str, Any], kind: Sensor
) -> dict[str, float]:
    """Coefficients that were estimated, in the field's units.

    B and K that are bounds come from the slow noise that the spectrum shows.
    """
    keys = SENSED[kind].keys
    found = {name: stated["coefficients"].get(key) for name, key in keys.items()}
    found["angle_random_walk"] = walk
    slow = stated.get("slow_noise") or {}
    return {
        **{
            name: slow[key]["value"]
            for name, key in keys.items()
            if key in slow and slow[key]["value"] > 0.0
        },
        **{
            name: one["value"]
            for name, one in found.items()
            if one is not None and one["status"] == "estimated"
        },
    }
