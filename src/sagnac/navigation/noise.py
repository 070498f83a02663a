"""N, B and K of one gyro or accelerometer, as a filter takes them."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.special import ndtri

from sagnac.core import documents, texts
from sagnac.core.arrays import FloatArray
from sagnac.core.errors import RecordingError, refusal
from sagnac.core.units import SENSED, Sensed, Sensor
from sagnac.navigation.models import FilterModel, Markov, require_numbers
from sagnac.navigation.settings import as_written
from sagnac.noise.laws import STOCHASTIC_NAMES, CoefficientName

NAMES: Final = STOCHASTIC_NAMES[1:]
"""N, B and K, in this order."""


def quantile(confidence: float) -> float:
    """Half of the width of an interval in standard errors."""
    return float(ndtri(0.5 + 0.5 * confidence))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GyroNoise:
    """Noise of one gyro, SI; of an accelerometer with m for rad.

    Attributes
    ----------
    angle_random_walk, bias_instability, rate_random_walk
        N in rad/sqrt(s), B in rad/s, K in rad/s/sqrt(s); 0 for what was not seen.
    markov
        Its Markov rates, if there are any.
    covariance
        (3, 3) of these three, SI.
    unseen
        Names of those that were not estimated: 0, or the most likely of slow noise that B and K
        are not told apart in.
    bounds
        Upper bounds of those, by name; what has none was not observable.

    Raises
    ------
    ValueError
        If one is negative or not finite, or the covariance has another shape.
    """

    angle_random_walk: float
    bias_instability: float = 0.0
    rate_random_walk: float = 0.0
    markov: tuple[Markov, ...] = ()
    covariance: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    unseen: tuple[CoefficientName, ...] = ()
    bounds: Mapping[CoefficientName, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_numbers(self, NAMES)
        if self.covariance.shape != (3, 3):
            raise refusal("covariance", f"has shape {self.covariance.shape}; give (3, 3)")

    @property
    def values(self) -> FloatArray:
        """(3,) N, B and K."""
        return np.array([getattr(self, name) for name in NAMES])

    @property
    def bounded(self) -> "tuple[GyroNoise, ...]":
        """The same with one upper bound after the other in the place of zero.

        The bounds of B and K are both of the slow noise that the curve leaves room for, which is
        there once.
        """
        raised: list[dict[str, Any]] = [{name: bound} for name, bound in self.bounds.items()]
        return tuple(replace(self, **one) for one in raised) or (self,)

    @property
    def without_likely(self) -> "GyroNoise":
        """The same without the slow noise that is most likely, and was not estimated."""
        unseen: dict[str, Any] = dict.fromkeys({*self.unseen} - {NAMES[0]}, 0.0)
        return replace(self, **unseen)

    def allan_variance(self, tau: float) -> float:
        """Allan variance at a cluster time, s: the three terms and the Markov rates together."""
        white, walk = self.angle_random_walk, self.rate_random_walk
        model = FilterModel(white=white, walk=walk, markov=self.markov)
        flicker = 2.0 * math.log(2.0) / math.pi * self.bias_instability**2
        return flicker + float(model.allan_deviation(np.array([tau]))[0]) ** 2

    @classmethod
    def unit(
        cls, source: documents.Documented | Mapping[str, Any] | str | Path
    ) -> "tuple[Triad, tuple[GyroNoise, ...]]":
        """The noise of the gyros and of the level accelerometers of an analysis.

        Parameters
        ----------
        source
            An analysis, its document, or the path of its ``analysis.json``.

        Returns
        -------
        gyros
            About x, y and z, each its own if the names tell and it was taken alone; else the
            loudest of the gyros, the same object for each axis that it stands for.
        accelerometers
            Along x and y if the names tell; else the loudest of what it has twice, or nothing.

        Raises
        ------
        RecordingError
            If a file is no analysis, or N of a gyro is neither estimated nor bounded.
        """
        if isinstance(source, str | Path):
            with as_written(Path(source)):
                return cls.unit(documents.read_one_analysis(Path(source)))
        document = source if isinstance(source, Mapping) else json.loads(source.to_json())
        # A triad has N of each gyro; B, K and the covariance are the pair's. If no gyro of it was
        # seen, `from_document` refuses the first.
        each = document.get("per_gyro") or {}
        seen = {name: walk for name, walk in each.items() if walk["status"] != "not observable"}
        own: dict[str, Any] = {
            name: {**document, "angle_random_walk": walk, "covariance": None}
            for name, walk in (seen or each).items()
        }
        alone = document.get("gyros") or own or {document["channel"]: document}
        measured = {name: cls.from_document(one) for name, one in alone.items()}
        # Compared at the cluster time, s, of a usual rest, and of a time without aiding.
        stand_in = max(measured.values(), key=lambda one: one.allan_variance(600.0))
        x, y, z = (texts.by_axis(measured).get(axis, stand_in) for axis in "xyz")
        forces = {
            name: cls.from_document(one, "accelerometer")
            for name, one in (document.get("accelerometers") or {}).items()
            if one["velocity_random_walk"]["status"] != "not observable"
        }
        level = [one for axis, one in sorted(texts.by_axis(forces).items()) if axis != "z"]
        if len(level) != 2:
            level = 2 * sorted(forces.values(), key=lambda one: one.angle_random_walk)[-1:]
        return (x, y, z), (*level,)

    @classmethod
    def from_document(cls, document: Mapping[str, Any], sensor: Sensor = "gyro") -> "GyroNoise":
        """The noise that an analysis of schema ``sagnac.analysis/1`` states, of a gyro or a force.

        What is not estimated is taken as 0 and named in `unseen`; if N has an upper bound only, N
        is that bound. B and K that are bounds are those of the slow noise that the spectrum shows,
        if it does.

        Raises
        ------
        RecordingError
            If N is not observable.
        """
        sensed, slow = SENSED[sensor], document.get("slow_noise") or {}
        values, errors, most = np.zeros(3), np.zeros(3), np.full(3, np.inf)
        unseen: list[CoefficientName] = []
        bounds: dict[CoefficientName, float] = {}
        for place, name in enumerate(NAMES):
            key, units = sensed.keys[name], sensed.coefficients[name]
            one = (document if place == 0 else document["coefficients"]).get(key) or {}
            status = one.get("status")
            # N that is a bound is taken at it; slow noise that is one, at the most likely.
            is_taken = status == "estimated" or (place == 0 and status == "upper bound")
            if taken := one if is_taken else slow.get(key):
                values[place] = taken["value"] * units[taken["unit"]]
            if status == "estimated":
                size, low, high = units[one["unit"]], one["low"] or 0.0, one["high"]
                errors[place] = 0.5 * size * (high - low) / quantile(one["confidence"])
                if low and values[place] > 0.0:
                    # Errors count for the logarithm of a variance: they reach to the farther end.
                    farther = math.log(max(high / one["value"], one["value"] / low))
                    most[place] = values[place] * farther / quantile(one["confidence"])
                continue
            unseen.append(name)
            if status == "upper bound":
                bounds[name] = one["high"] * units[one["unit"]]
        if values[0] == 0.0:
            problem = "its angle random walk is not observable"
            raise RecordingError(problem, remedy="give a longer recording")
        confidence = document[sensed.keys["angle_random_walk"]]["confidence"]
        stated = document.get("covariance")
        covariance = _covariance(stated, unseen, sensed) if stated else np.diag(errors**2)
        kept = np.divide(most, errors, out=np.ones(3), where=errors > most)
        sizes = sensed.coefficients["bias_instability"]
        rates = (slow[key] for key in ("markov", "second_markov") if slow.get(key))
        return cls(
            **dict(zip(NAMES, values.tolist(), strict=True)),
            markov=tuple(_markov(one, sizes, confidence) for one in rates),
            covariance=covariance * np.outer(kept, kept),
            unseen=tuple(unseen),
            bounds=bounds,
        )


def _markov(stated: Mapping[str, Any], sizes: Mapping[str, float], confidence: float) -> Markov:
    """A Markov rate that a document states, SI.

    The variance that it makes is the product of the squared deviation and the time for all that is
    long beside it.
    """
    size, time = stated["deviation"], stated["correlation_time_s"]
    ratios = (one.get("high", one["value"]) / one.get("low", one["value"]) for one in (size, time))
    of_size, of_time = (0.5 * math.log(ratio) for ratio in ratios)
    error = math.hypot(2.0 * of_size, of_time) / quantile(confidence)
    return Markov.of_deviation(size["value"] * sizes[size["unit"]], time["value"], error=error)


def _covariance(stated: Mapping[str, Any], unseen: Sequence[str], sensed: Sensed) -> FloatArray:
    """(3, 3) of N, B and K in SI as a document states it."""
    covariance = np.zeros((3, 3))
    # Places of N, B and K here and there, and the size of the unit that each has there.
    seen = [
        (row, place, sensed.coefficients[name][stated["units"][place]])
        for row, name in enumerate(NAMES)
        for place, title in enumerate(stated["names"])
        if title == sensed.keys[name] and name not in unseen
    ]
    for (row, at, size), (column, to, other) in product(seen, repeat=2):
        covariance[row, column] = stated["matrix"][at][to] * (size * other)
    return covariance


Triad = tuple[GyroNoise, GyroNoise, GyroNoise]
"""Gyros about north, east and down."""
