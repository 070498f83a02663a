"""What a filter is set to: for each gyro the models above its curve, continuous and discrete."""

import math
from dataclasses import dataclass

from sagnac.errors import RecordingError
from sagnac.filters.overbound import Overbound, overbound, upper_limit
from sagnac.filters.sensors import Sensor
from sagnac.units import DEGREE_PER_HOUR_PER_ROOT_HOUR, DEGREE_PER_ROOT_HOUR


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterSetting:
    """The models of one gyro.

    Attributes
    ----------
    sensor
        What they are of.
    simple
        White noise and a random walk, all that most tools take.
    full
        With Markov rates, and white angle noise if the recording shows it.
    """

    sensor: Sensor
    simple: Overbound
    full: Overbound

    def in_words(self) -> str:
        """The simple model in one line, in the field's units, ASCII."""
        model, white = self.simple.model, self.sensor.white
        estimated = (
            "not estimated" if math.isnan(white) else f"{model.white / white:.3f} of the estimate"
        )
        return (
            f"{self.sensor.name}: N {model.white / DEGREE_PER_ROOT_HOUR:.4g} deg/sqrt(h) "
            f"({estimated}), K {model.walk / DEGREE_PER_HOUR_PER_ROOT_HOUR:.4g} deg/h/sqrt(h), "
            f"{self.simple.inflation:.3f} of the Allan deviation (median)"
        )


def setting_of(sensor: Sensor, *, confidence: float = 0.95, most_markov: int = 2) -> FilterSetting:
    """The models of one gyro, above the upper confidence limit of its curve.

    Parameters
    ----------
    sensor
        Its curve and its N.
    confidence
        That the Allan deviation of the gyro lies below that of the models, at all cluster times of
        twenty degrees of freedom or more together.
    most_markov
        Of the full model.

    Raises
    ------
    RecordingError
        If the curve is too short.
    """
    limit = upper_limit(sensor.tau, sensor.deviation, sensor.edf, confidence=confidence)
    # What is estimated in the spectrum counts even if a low-pass hides it from the curve.
    seen = 0.0 if math.isnan(sensor.white) else sensor.white_high
    return FilterSetting(
        sensor=sensor,
        simple=overbound(limit, most_markov=0, least_white=seen, walks=True),
        full=overbound(limit, most_markov=most_markov, least_white=seen, angle=sensor.angle > 0.0),
    )


def worst(settings: "tuple[FilterSetting, ...]") -> FilterSetting:
    """The one whose simple model has the largest white noise.

    Raises
    ------
    RecordingError
        If there is none.
    """
    if not settings:
        raise RecordingError("no gyro", remedy="give an analysis of one gyro or more")
    return max(settings, key=lambda one: one.simple.model.white)
