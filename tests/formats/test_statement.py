"""What is stated, and what cannot be."""

import math

import pytest

from sagnac.formats import Statement
from sagnac.formats.statement import VOCABULARY, one_statement


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ({"kind": "angel"}, "kind is 'angel'.*angle, increment, rate"),
        ({"kind": {"x": "angel"}}, "kind is 'angel'.*angle, increment, rate"),
        ({"unit": "furlong"}, "unit is 'furlong'.*arcsec.*deg/s.*counts"),
        ({"unit": {"x": 5}}, "unit is 5"),
        ({"unit": "2counts"}, "unit is '2counts'"),
        ({"scale": "counts"}, "scale is 'counts'.*0.1arcsec"),
        ({"scale": "0arcsec"}, "scale is '0arcsec'"),
        ({"scale": 0.1}, "scale is 0.1"),
        ({"sample_rate": -1.0}, "sample_rate is -1.0.*above zero"),
        ({"sample_rate": math.nan}, "sample_rate is nan"),
        ({"counter_bits": 7}, "counter_bits is 7.*8 to 48"),
        ({"counter_bits": 16, "counter_period": 7.0}, "counter_bits and a period are both given"),
        ({"span": 5}, "span is 5; give start and stop in s"),
        ({"span": (0.0, "2")}, "span is .*; give start and stop in s"),
        ({"gyros": 5}, "gyros is 5; give one or more different names"),
        ({"gyros": ("x", "x")}, "gyros is .*different"),
        ({"gyros": ()}, "gyros is .*one or more"),
        ({"gyros": "x,y"}, r"gyros is 'x,y'; give .* such as \('x', 'z'\)"),
        ({"accelerometers": "ax"}, r"accelerometers is 'ax'; give .* such as \('x', 'z'\)"),
        ({"gyros": ("x", "")}, "gyros is"),
        ({"span": (5.0, 5.0)}, r"span is \(5.0, 5.0\)"),
        ({"span": (-1.0, None)}, r"span is \(-1.0, None\)"),
        ({"time": 5}, "time is 5"),
        ({"columns": {"x": 2}}, "columns is"),
    ],
)
def test_arguments_that_cannot_be(statement, said):
    with pytest.raises(ValueError, match=said) as caught:
        Statement(**statement)
    assert "\n" not in str(caught.value)


def test_a_span_is_the_callers_alone():
    assert "span" not in VOCABULARY
    assert {"kind", "unit", "sample_rate"} < VOCABULARY


def test_a_caller_states_by_fields_or_by_a_statement():
    stated = {"kind": "rate", "unit": "deg/h", "span": (1.0, None)}
    assert one_statement(None, stated) == Statement(**stated)
    assert one_statement(None, {}) == Statement()
    own = Statement(kind="rate")
    assert one_statement(own, {}) is own
    with pytest.raises(ValueError, match="kind, unit and a statement are given"):
        one_statement(own, {"kind": "rate", "unit": "deg/h"})
    with pytest.raises(TypeError, match="'rate' is nothing to state; use one of gyros, kind, unit"):
        one_statement(None, {"rate": 100.0})
    with pytest.raises(ValueError, match="kind is 'angel'; use one of angle"):
        one_statement(None, {"kind": "angel"})
