"""Channels: what they refuse, and the units they are made from and shown in."""

import numpy as np
import pytest

from sagnac.recording.channel import Channel, numbers, same_values

DEGREE = 0.017453292519943295


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "rates"}, "kind is 'rates'; use one of angle, increment, rate"),
        ({"name": ""}, "name is ''"),
        ({"shown_in": "arcsec"}, "unit 'arcsec' is not a unit of rate; use one of rad/s, deg/s"),
        ({"kind": "angle", "shown_in": "deg/s"}, "unit 'deg/s' is not a unit of angle"),
        ({"values": np.zeros((2, 3))}, r"float64 of shape \(2, 3\); give float64 of shape"),
        ({"values": np.zeros(3, dtype=np.float32)}, "values are float32 of shape"),
        ({"values": [1.0, 2.0]}, "values are a list; .* or use Channel.from_values"),
    ],
)
def test_what_is_no_channel_is_refused_with_the_choices(change, words):
    arguments = {"name": "x", "kind": "rate", "values": np.zeros(3), **change}
    with pytest.raises(ValueError, match=words) as caught:
        Channel(**arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "unit", "size"),
    [
        ("rate", "deg/s", DEGREE),
        ("rate", "°/h", DEGREE / 3600.0),
        ("angle", "0.1arcsec", 0.1 * DEGREE / 3600.0),
        ("increment", "rad", 1.0),
    ],
)
@pytest.mark.parametrize("values", [[1.0, -2.0, 3.5], np.array([1, -2, 3], dtype=np.int16)])
def test_values_are_converted(kind, unit, size, values):
    channel = Channel.from_values("x", values, kind=kind, unit=unit)
    assert channel.values == pytest.approx(np.asarray(values) * size, rel=1e-14)
    assert channel.shown_in == unit
    assert channel.values_in(unit) == pytest.approx(np.asarray(values), rel=1e-14)


def test_what_a_channel_is_made_of_is_left_alone():
    values = np.array([1.0, np.nan])
    channel = Channel.from_values("x", values, kind="rate", unit="rad/s")
    channel.values[0] = 5.0
    assert values[0] == 1.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"unit": "arcsec"}, "channel x of kind rate: unit 'arcsec' is not a unit of rate"),
        ({"unit": "counts"}, "unit 'counts' is not a unit of rate"),
        ({"kind": "speed"}, "kind is 'speed'"),
        ({"values": ["a", "b"]}, "x holds <U1 values; give real numbers"),
        ({"values": [1j]}, "x holds complex128 values"),
        ({"values": [[1.0], [2.0]]}, r"x has shape \(2, 1\)"),
        ({"values": [[1.0, 2.0], [3.0]]}, r"x is \[\[1.0, 2.0\], \[3.0\]\]; give one column"),
        ({"values": Channel(name="z", kind="rate", values=np.zeros(3))}, r"x is Channel\(z: 3 .*;"),
    ],
)
def test_what_cannot_be_converted_is_refused(arguments, words):
    arguments = {"values": [1.0], "kind": "rate", "unit": "deg/s", **arguments}
    with pytest.raises(ValueError, match=words) as caught:
        Channel.from_values("x", **arguments)
    assert "\n" not in str(caught.value)


def test_masked_and_missing_numbers_become_nan():
    masked = np.ma.masked_array([1, 2, 3], mask=[False, True, False])
    np.testing.assert_array_equal(numbers(masked, "x"), [1.0, np.nan, 3.0])
    np.testing.assert_array_equal(numbers(np.array([1.0, None], dtype=object), "x"), [1.0, np.nan])


@pytest.mark.parametrize(
    ("name", "kind", "shown_in", "plain"),
    [
        ("x", "rate", "dps", "deg/s"),
        ("x", "rate", "0.5deg/s", "deg/h"),
        ("x", "angle", "0.1arcsec", "arcsec"),
        ("table", "angle", "0.1arcsec", "deg"),
        ("x", "increment", "", "rad"),
    ],
)
def test_the_unit_to_write_in_has_no_number_before_it(name, kind, shown_in, plain):
    channel = Channel(name=name, kind=kind, values=np.zeros(2), shown_in=shown_in)
    assert channel.plain_unit.name == plain


def test_channels_compare_by_their_values():
    values = np.array([1.0, np.nan])
    one = Channel(name="x", kind="rate", values=values)
    assert one == Channel(name="x", kind="rate", values=values.copy())
    assert one != Channel(name="x", kind="rate", values=np.array([1.0, 2.0]))
    assert one != Channel(name="z", kind="rate", values=values)
    assert one != "x"
    assert not same_values(values, None)
    assert not same_values(values, values[:1])
