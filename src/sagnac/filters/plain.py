"""The full models as plain data: TOML, and JSON of schema ``sagnac.filter/1``."""

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from sagnac.errors import one_line
from sagnac.filters.definitions import DEFINITIONS
from sagnac.filters.settings import FilterSetting
from sagnac.filters.state_space import FilterModel
from sagnac.units import Sensor, field_unit

# Names that TOML takes without quotes.
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")
# By kind of sensor: the integral, a sample, and N and K in the field's units, as keys.
_KEYS: Final[Mapping[Sensor, tuple[str, str, str, str]]] = {
    "gyro": ("rad", "rad_per_s", "deg_per_sqrt_h", "deg_per_h_per_sqrt_h"),
    "accelerometer": ("m_per_s", "m_per_s2", "m_per_s_per_sqrt_h", "mg_per_sqrt_h"),
}
_WALK: Final[Mapping[Sensor, str]] = {"gyro": "rad_per_s2", "accelerometer": "m_per_s3"}


def plain(
    gyros: Sequence[FilterSetting],
    accelerometers: Sequence[FilterSetting],
    *,
    rate: float,
    version: str,
) -> dict[str, Any]:
    """Simple and full models of some sensors, continuous and discrete.

    Parameters
    ----------
    gyros, accelerometers
        Each sensor of its kind.
    rate
        Of the discrete form, Hz.
    version
        Of this package.
    """
    definition, limit = DEFINITIONS["toml"], gyros[0].limit
    bound = {}
    if limit is not None:
        bound = {
            "confidence": limit.confidence,
            "tau_s": [float(limit.tau[0]), float(limit.tau[-1])],
        }
    forces = {one.name: _sensor(one, rate) for one in accelerometers}
    return {
        "schema": "sagnac.filter/1",
        "version": version,
        "definition": definition.text,
        "reference": definition.reference,
        **bound,
        "update_rate_hz": rate,
        "sensors": {one.name: _sensor(one, rate) for one in gyros},
        **({"accelerometers": forces} if forces else {}),
    }


def _sensor(setting: FilterSetting, rate: float) -> dict[str, Any]:
    covariance = setting.covariance
    return {
        "source": setting.source,
        "measured": setting.limit is not None,
        "simple": _model(setting, setting.simple, rate),
        "full": _model(setting, setting.full, rate),
        **({} if covariance is None else {"covariance": dict(covariance)}),
        **({"stated": dict(setting.stated)} if setting.stated else {}),
    }


def _model(setting: FilterSetting, model: FilterModel, rate: float) -> dict[str, Any]:
    step, inflation, kind = 1.0 / rate, setting.inflation(model), setting.kind
    integral, sample, white, walk = _KEYS[kind]
    sizes = [field_unit(name, kind).size for name in ("angle_random_walk", "rate_random_walk")]
    return {
        **({} if inflation is None else {"inflation": inflation}),
        "continuous": {
            f"white_{sample}_per_sqrt_hz": model.white,
            f"white_{white}": model.white / sizes[0],
            f"walk_{_WALK[kind]}_per_sqrt_hz": model.walk,
            f"walk_{walk}": model.walk / sizes[1],
            f"{'angle' if kind == 'gyro' else 'velocity'}_{integral}": model.angle,
            "markov": [
                {
                    f"driving_noise_{sample}_per_sqrt_s": one.driving_noise,
                    "correlation_time_s": one.correlation_time,
                    f"deviation_{sample}": one.deviation,
                }
                for one in model.markov
            ],
        },
        "discrete": {
            f"white_{sample}": model.white_per_sample(step),
            f"walk_{sample}": model.walk_per_sample(step),
            "markov": [
                {"decay": one.decay(step), f"step_{sample}": one.step(step)} for one in model.markov
            ],
        },
    }


def toml_table(table: Mapping[str, Any], path: str = "") -> str:
    """A table as TOML: plain values first, then the tables below them."""
    text = "".join(
        f"{_key(key)} = {_value(value)}\n"
        for key, value in table.items()
        if not isinstance(value, Mapping)
    )
    for key, value in table.items():
        if isinstance(value, Mapping):
            below = f"{path}{_key(key)}."
            text += f"\n[{below[:-1]}]\n{toml_table(value, below)}"
    return text


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, Mapping):
        items = (f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(value, str):
        # TOML escapes as JSON does, and the delete character as well.
        return json.dumps(one_line(value), ensure_ascii=False)
    return json.dumps(value)
