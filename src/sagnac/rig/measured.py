"""The measurement of an analysis as keys of the rig's configuration."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Self

from sagnac.rig.sections import ACCELEROMETER_NAMES, GYRO_NAMES
from sagnac.units import SENSED, Sensor

# By kind of sensor: the section, and coefficient -> its key, whose unit is the field's own.
_KEYS: Final[Mapping[Sensor, Mapping[str, str]]] = {
    "gyro": {
        "quantization": "angle_noise_arcsec",
        "angle_random_walk": "arw_deg_per_sqrt_h",
        "bias_instability": "bias_instability_deg_per_h",
        "rate_random_walk": "rate_random_walk_deg_per_h_per_sqrt_h",
        "rate_ramp": "rate_ramp_deg_per_h_per_h",
    },
    "accelerometer": {
        "quantization": "velocity_noise_mm_per_s",
        "angle_random_walk": "vrw_m_per_s_per_sqrt_h",
        "bias_instability": "bias_instability_mg",
        "rate_random_walk": "acceleration_random_walk_mg_per_sqrt_h",
        "rate_ramp": "acceleration_ramp_mg_per_h",
    },
}
_FORCE_WALK: Final = "velocity_random_walk"
_NAMES: Final[Mapping[Sensor, tuple[str, str, str]]] = {
    "gyro": GYRO_NAMES,
    "accelerometer": ACCELEROMETER_NAMES,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """The sensors of one analysis.

    Attributes
    ----------
    gyros, accelerometers
        Name -> coefficient -> its value in the field's unit; what was not estimated is not there.
    sample_rate, duration
        Hz and s.
    kind
        Of a sample; empty if it is not stated.
    low_passes
        Name -> corner, Hz, and order of the low-pass that its spectrum shows.
    table_rate
        deg/s, 0 at rest.
    """

    gyros: Mapping[str, Mapping[str, float]]
    accelerometers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    sample_rate: float
    duration: float
    table_rate: float = 0.0
    kind: str = ""
    low_passes: Mapping[str, tuple[float, int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.gyros:
            raise ValueError("gyros is empty; give an analysis of a gyro")

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> Self:
        """The sensors of a document of schema ``sagnac.analysis/1``."""
        read = document["input"]
        alone = document.get("gyros") or {document["channel"]: document}
        gyros = {
            name: _of_document(one["coefficients"], one["angle_random_walk"], "gyro")
            for name, one in alone.items()
        }
        if not document.get("gyros"):
            # A triad on a table has only N of each gyro; the other terms are those of the pair.
            (pair,) = gyros.values()
            gyros = {
                name: {**pair, **_of_document({}, own, "gyro")}
                for name, own in document["per_gyro"].items()
                if own["status"] == "estimated"
            } or gyros
        forces = (document.get("accelerometers") or {}).items()
        return cls(
            gyros=gyros,
            accelerometers={
                name: _of_document(one["coefficients"], one[_FORCE_WALK], "accelerometer")
                for name, one in forces
            },
            sample_rate=read["sample_rate_hz"],
            duration=read["duration_s"],
            table_rate=read.get("table_rate_deg_per_s") or 0.0,
            kind=read.get("kind") or "",
            low_passes={
                name: (one["low_pass"]["corner_hz"], one["low_pass"]["order"])
                for name, one in (*alone.items(), *forces)
                if one.get("low_pass")
            },
        )

    def keys(self) -> dict[str, Any]:
        """Nested tables of a `RigConfig`."""
        kinds: dict[Sensor, Mapping[str, Mapping[str, float]]] = {"gyro": self.gyros}
        if self.accelerometers:
            kinds["accelerometer"] = self.accelerometers
        tables: dict[str, dict[str, Any]] = {
            kind: {
                key: [found[name].get(coefficient, 0.0) for name in _three(found, _NAMES[kind])]
                for coefficient, key in _KEYS[kind].items()
            }
            for kind, found in kinds.items()
        }
        for kind, found in kinds.items():
            passes = [self.low_passes.get(name) for name in _three(found, _NAMES[kind])]
            tables[kind]["low_pass_hz"] = [one[0] if one else 0.0 for one in passes]
            # The rig has one order for all: that of the lowest corner.
            tables[kind]["low_pass_order"] = min((one for one in passes if one), default=(0.0, 1))[
                1
            ]
        tables["gyro"]["quantization_step_arcsec"] = 0.0
        if self.accelerometers:
            tables["accelerometer"]["mode"] = "triad"
        return {
            "duration_s": self.duration,
            "sample_rate_hz": self.sample_rate,
            **({"kind": self.kind} if self.kind else {}),
            "table": {"rate_deg_per_s": self.table_rate},
            **tables,
        }

    def left_out(self) -> list[str]:
        """Low-passes, and parts that are not simulated as they were measured, a line each."""
        lines = [
            f"{name}: low-pass of {corner:.4g} Hz, order {order}"
            for name, (corner, order) in self.low_passes.items()
        ] or ["no low-pass, since the spectrum shows none"]
        kinds: dict[Sensor, Mapping[str, Mapping[str, float]]] = {
            "gyro": self.gyros,
            "accelerometer": self.accelerometers,
        }
        for kind, found in kinds.items():
            titles = SENSED[kind].titles
            for name, one in found.items():
                missing = [title for key, title in titles.items() if key not in one]
                if missing:
                    lines.append(f"{name}: without {', '.join(missing)}, not estimated")
            orders = {self.low_passes[name][1] for name in found if name in self.low_passes}
            if len(orders) > 1:
                lines.append(f"low-passes of the {kind}s: of one order, as the rig has them")
            others = [name for name in _NAMES[kind] if name not in found]
            if found and others and len(found) != 3:
                lines.append(f"{', '.join(others)}: as {next(iter(found))}")
        return lines


def _three(found: Mapping[str, object], names: tuple[str, str, str]) -> list[str]:
    """Names of the sensors for the three axes: by name, in order if none fits, else the first."""
    if len(found) == 3 and not set(names) & set(found):
        return list(found)
    first = next(iter(found))
    return [name if name in found else first for name in names]


def _of_document(
    coefficients: Mapping[str, Any], walk: Mapping[str, Any], kind: Sensor
) -> dict[str, float]:
    """Coefficients that were estimated, in the field's units."""
    titles = SENSED[kind].titles
    stated = {name: coefficients.get(title.replace(" ", "_")) for name, title in titles.items()}
    stated["angle_random_walk"] = walk
    return {
        name: one["value"]
        for name, one in stated.items()
        if one is not None and one["status"] == "estimated"
    }
