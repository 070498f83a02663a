"""Limits that a gyro has to keep: of Q, N, B, K and R, and the risk of passing one that does not.

A specification is a text (``3e-4deg/sqrt(h)``, ``N=3e-4deg/sqrt(h),B=0.01deg/h``) or a TOML file
for a product.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sagnac.core import errors
from sagnac.core.documents import ANY, NUMBER, read_toml, table
from sagnac.core.errors import quoted, refusal
from sagnac.core.units import Unit, field_unit, split_factor, unit_of
from sagnac.noise.laws import COEFFICIENT_NAMES, SYMBOLS, CoefficientName

_BY_LETTER: Final = {letter: name for name, letter in SYMBOLS.items()}
_NAMES: Final = _BY_LETTER | {name: name for name in COEFFICIENT_NAMES}
# A limit stands in the table of them or beside it.
_EXAMPLE: Final = 'write [limits] and N = "3e-4 deg/sqrt(h)" below it'
_LIMITS: Final = {"type": "object", "description": _EXAMPLE}
_RISK: Final = {**NUMBER, "description": "give a number between 0 and 0.5"}
_KEYS: Final = {"product": ANY, "risk": _RISK, "limits": _LIMITS}


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """Largest value that one coefficient may have.

    Attributes
    ----------
    coefficient
        Which one.
    value
        SI.
    unit
        The unit that it was stated in.

    Raises
    ------
    ValueError
        If the coefficient is not known, or the value is not a finite number above zero.
    """

    coefficient: CoefficientName
    value: float
    unit: Unit

    def __post_init__(self) -> None:
        errors.require_choice("coefficient", self.coefficient, CoefficientName)
        if not (math.isfinite(self.value) and self.value > 0.0):
            raise refusal("value", f"is {quoted(self.value)}; give a finite number above zero")
        if self.unit.quantity != field_unit(self.coefficient).quantity:
            raise refusal("unit", f"{self.unit} is not a unit of {self.coefficient}")

    @property
    def letter(self) -> str:
        """Q, N, B, K or R."""
        return SYMBOLS[self.coefficient]

    @property
    def in_unit(self) -> float:
        """The value in the unit that it was stated in."""
        return self.value / self.unit.size

    @property
    def in_words(self) -> str:
        """The limit as it was stated: ``N ≤ 0.0003 °/√h``."""
        return f"{self.letter} ≤ {self.in_unit:.6g} {self.unit.symbol}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Specification:
    """Limits that a gyro has to keep.

    Attributes
    ----------
    limits
        One or more, each coefficient once.
    risk
        Largest probability of passing a gyro that lies at its limit; None: what the interval
        leaves, half of what its confidence lacks (for an upper bound all of it).
    product
        What the specification is of, or empty.

    Raises
    ------
    ValueError
        If there is no limit, a coefficient has two, or the risk is not between 0 and 0.5.

    Examples
    --------
    >>> from sagnac.verdict.limits import specification_of
    >>> limits = specification_of("N=0.003deg/sqrt(h),B=0.01deg/h", risk=0.05).limits
    >>> [limit.coefficient for limit in limits]
    ['angle_random_walk', 'bias_instability']
    """

    limits: tuple[Limit, ...]
    risk: float | None = None
    product: str = ""

    def __post_init__(self) -> None:
        names = [limit.coefficient for limit in self.limits]
        if not names or len(set(names)) != len(names):
            problem = "needs one limit or more, one for each coefficient at most"
            raise refusal("specification", problem)
        if self.risk is not None and not (errors.is_finite(self.risk) and 0.0 < self.risk < 0.5):
            raise refusal("risk", f"is {quoted(self.risk)}; give a number between 0 and 0.5")


def specification_of(text: str | Specification, *, risk: float | None = None) -> Specification:
    """The specification that a text states.

    Parameters
    ----------
    text
        A number with a unit, which is a limit of N; ``N=…,B=…`` for several; or the path of a
        TOML file, which ends in ``.toml``. A number without a unit is in the field's unit. A
        specification stands as it is.
    risk
        As in `Specification`; goes before that of a file.

    Raises
    ------
    ValueError
        If the text states none, or a risk is given beside a specification, which has its own.
    TypeError
        If it is neither.
    RecordingError
        If the file cannot be read.

    Examples
    --------
    >>> specification_of("3e-4deg/sqrt(h)").limits[0].letter
    'N'
    >>> [str(limit.unit) for limit in specification_of("N=3e-4,B=0.01deg/h").limits]
    ['deg/sqrt(h)', 'deg/h']
    """
    if isinstance(text, Specification):
        if risk is not None:
            fact = "and the specification has its own; state one"
            raise refusal("risk", f"is {quoted(risk)}, {fact}")
        return text
    if not isinstance(text, str):
        problem = f"is {quoted(text)}; give '3e-4deg/sqrt(h)'"
        raise errors.ArgumentTypeError("specification", problem)
    if text.strip().endswith(".toml"):
        return _of_file(Path(text.strip()), risk)
    if not text.strip():
        raise refusal("specification", "is empty; give a limit such as 3e-4deg/sqrt(h)")
    if re.match(r"\s*(\w\s*=\s*)?\d+,\d", text):
        raise refusal("specification", f"{text!r} has a decimal comma; give a decimal point")
    stated = [item.rpartition("=") for item in text.split(",")]
    limits = tuple(_limit(name.strip() or "N", value) for name, _, value in stated)
    return Specification(limits=limits, risk=risk)


def _of_file(path: Path, risk: float | None) -> Specification:
    try:
        stated = read_toml(path, table(_KEYS | dict.fromkeys(_NAMES, ANY)))
        limits = {name: stated[name] for name in _NAMES if name in stated}
        limits |= stated.get("limits", {})
        listed = tuple(_limit(name, value) for name, value in limits.items())
        product, risk = str(stated.get("product", "")), stated.get("risk") if risk is None else risk
        return Specification(limits=listed, risk=risk, product=product)
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
        raise errors.RecordingError(problem, path=str(path), remedy="check the path") from None
    except ValueError as error:
        problem = str(error).removeprefix("specification ")
        raise refusal("specification", f"{path}: {problem}") from None


def _limit(name: str, stated: object) -> Limit:
    if name not in _NAMES:
        remedy = f"use {', '.join(SYMBOLS.values())} (risk and product besides in a file)"
        raise refusal("specification", f"{name!r} is no coefficient; {remedy}")
    coefficient, text = _NAMES[name], str(stated)
    unit = field_unit(coefficient)
    try:
        number = float(text)
    except ValueError:
        number, unit_name = split_factor(text.strip())
        if not text.strip()[:1].isdigit() and not text.strip().startswith("."):
            remedy = "give a limit such as 3e-4deg/sqrt(h)"
            raise refusal("specification", f"{text!r} has no number; {remedy}") from None
        try:
            unit = unit_of(unit_name, unit.quantity)
        except ValueError as error:
            raise refusal("specification", f"{text!r} of {SYMBOLS[coefficient]}: {error}") from None
    if not (math.isfinite(number) and number > 0.0):
        raise refusal("specification", f"{text.strip()!r} is no limit; give a number above zero")
    return Limit(coefficient=coefficient, value=number * unit.size, unit=unit)
