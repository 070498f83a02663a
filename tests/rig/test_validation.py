"""Rules of configuration keys, each by itself."""

from dataclasses import dataclass
from typing import Annotated, Literal

import pytest

from sagnac.rig.sections import (
    ConfigurationError,
    Number,
    allowed,
    check,
    overlaid,
    rules_of,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Inner:
    rates: Annotated[tuple[float, float, float], Number(0.0, 2.0)] = (0, 0, 0)
    pairs: Annotated[
        tuple[tuple[float, float], ...],
        Number(0.0, 9.0, "order"),
        Number(0.0, 1.0, "arcsec"),
    ] = ()

    def __post_init__(self):
        check(self, "inner.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Outer:
    count: Annotated[int, Number(1, 2**31)] = 1
    mode: Literal["slow", "fast"] = "slow"
    inner: Inner = Inner()

    def __post_init__(self):
        check(self)


def test_rules_are_found_by_dotted_name():
    found = rules_of(Outer)
    assert list(found) == ["count", "mode", "inner.rates", "inner.pairs"]
    assert [allowed(rule) for rule in found.values()] == [
        "1 to 2147483648",
        '`"slow"`, `"fast"`',
        "0 to 2",
        "list of [order 0 to 9, arcsec 0 to 1]",
    ]


@pytest.mark.parametrize("value", [1.5, (1.5, 1.5, 1.5), [1.5, 1.5, 1.5]])
def test_one_number_and_lists_are_stored_as_three(value):
    assert Inner(rates=value).rates == (1.5, 1.5, 1.5)


def test_lists_of_pairs_are_stored_as_tuples():
    assert Inner(pairs=[[1, 0.5], (2, 0)]).pairs == ((1, 0.5), (2, 0))


@pytest.mark.parametrize(
    ("make", "problem", "remedy"),
    [
        (lambda: Outer(count=0), "count is 0", "it must lie from 1 to 2147483648"),
        (lambda: Outer(count=True), "count is True", "it must be a number from 1 to 2147483648"),
        (lambda: Outer(count="1"), "count is '1'", "it must be a whole number"),
        (lambda: Outer(mode="swift"), "mode is 'swift'", "use one of slow, fast"),
        (lambda: Outer(inner=None), "inner is None", "it is a table, write [inner]"),
        (lambda: Inner(rates=(1, 2)), "inner.rates is (1, 2)",
         "it must be a number or a list of three"),
        (lambda: Inner(rates=(1, 2, 3)), "inner.rates is 3", "it must lie from 0 to 2"),
        (lambda: Inner(rates=(1, None, 1)), "inner.rates is None",
         "it must be a number from 0 to 2"),
        (lambda: Inner(pairs=3), "inner.pairs is 3", "it must be a list of pairs [order, arcsec]"),
        (lambda: Inner(pairs=[3]), "inner.pairs holds 3",
         "it must be a list of pairs [order, arcsec]"),
        (lambda: Inner(pairs=[(1, 2)]), "inner.pairs (arcsec) is 2", "it must lie from 0 to 1"),
    ],
)  # fmt: skip
def test_what_is_not_allowed_is_named_with_the_remedy(make, problem, remedy):
    with pytest.raises(ConfigurationError) as caught:
        make()
    assert (caught.value.problem, caught.value.remedy) == (problem, remedy)
    assert str(caught.value) == f"{problem}; {remedy}"


def test_nested_tables_are_laid_over_a_base():
    base = Outer(count=3, inner=Inner(rates=2.0))
    changed = overlaid(base, {"mode": "fast", "inner": {"pairs": [[1, 1]]}})
    assert changed == Outer(count=3, mode="fast", inner=Inner(rates=2.0, pairs=((1, 1),)))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"coutn": 1}, "unknown key 'coutn'; did you mean count? known here: count, mode, inner"),
        ({"inner": {"pair": 1}},
         "unknown key 'inner.pair'; did you mean inner.pairs? known here: rates, pairs"),
        ({"zzz": 1}, "unknown key 'zzz'; known here: count, mode, inner"),
    ],
)  # fmt: skip
def test_an_unknown_key_is_refused_with_the_nearest(values, message):
    with pytest.raises(ConfigurationError) as caught:
        overlaid(Outer(), values)
    assert str(caught.value) == message
