"""Campaigns for tests: designs that are simulated, and one that is published."""

from collections.abc import Mapping

import numpy as np

from sagnac.fleet.design import Design


def design_of(values, factors, variances=0.0):
    """Runs of known variances, one or one each, which are zero if nothing is known."""
    numbers = np.asarray(values, dtype=np.float64)
    known = np.broadcast_to(np.asarray(variances, dtype=np.float64), numbers.shape)
    return Design(values=numbers, factors=factors, variances=known)


# Davies, Statistical Methods in Research and Production, 1947: yield of dyestuff in grams, five
# samples of each of six batches. The restricted estimates are printed in many texts.
DYESTUFF = design_of(
    [
        *(1545, 1440, 1440, 1520, 1580),
        *(1540, 1555, 1490, 1560, 1495),
        *(1595, 1550, 1605, 1510, 1560),
        *(1445, 1440, 1595, 1465, 1545),
        *(1595, 1630, 1515, 1635, 1625),
        *(1520, 1455, 1450, 1480, 1445),
    ],
    {"batch": tuple(batch for batch in "ABCDEF" for _ in range(5))},
)

CELLS = [(unit, day, rate) for unit in range(3) for day in range(3) for rate in range(4)]


class Campaign:
    """Effects drawn for 3 units, 3 days and 4 rates, and one more of each."""

    def __init__(
        self, truth: Mapping[str, float], random: np.random.Generator, *, measured: float = 0.01
    ) -> None:
        self.truth = truth
        self.units = random.normal(0.0, truth["unit"], 4)
        self.days = random.normal(0.0, truth["day"], 4)
        self.rates = random.normal(0.0, truth["rate"], 5)
        known = (measured * random.uniform(0.5, 2.0, len(CELLS))) ** 2
        values = [self._effects(*cell) for cell in CELLS]
        values += random.normal(0.0, truth["run"], len(CELLS))
        values += random.normal(0.0, np.sqrt(known))
        self.design = design_of(
            values,
            {
                name: tuple(str(cell[place]) for cell in CELLS)
                for place, name in enumerate(("unit", "day", "rate"))
            },
            known,
        )
        self.further_error = random.normal(0.0, np.hypot(truth["run"], 1.25 * measured))

    def _effects(self, unit: int, day: int, rate: int) -> float:
        return float(self.units[unit] + self.days[day] + self.rates[rate])

    @property
    def next_unit(self) -> float:
        """A run of the next unit, on the next day, at the next rate."""
        return self._effects(3, 3, 4) + self.further_error

    @property
    def next_day(self) -> float:
        """A run of the first unit on the next day, at the first rate."""
        return self._effects(0, 3, 0) + self.further_error

    @property
    def next_day_and_rate(self) -> float:
        """A run of the first unit on the next day, at the next rate."""
        return self._effects(0, 3, 4) + self.further_error
