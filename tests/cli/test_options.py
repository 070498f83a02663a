"""What was typed, and what the library is given of it."""

import dataclasses

import pytest

from sagnac.cli import main
from sagnac.cli.options import NO_OPTIONS, Options, settings_of, statement_of
from sagnac.core.texts import by_name, names, one_or_by_name, seconds, span


@pytest.mark.parametrize(
    ("text", "value"),
    [("1", 1.0), ("1s", 1.0), ("0.5 s", 0.5), ("100ms", 0.1), ("2h", 7200.0), ("15min", 900.0)],
)
def test_times_may_carry_a_unit(text, value):
    assert seconds(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["", "s", "soon", "0s", "-1", "nan", "inf", "1 furlong", "1deg"])
def test_what_is_no_time_above_zero_is_refused(text):
    with pytest.raises(ValueError, match="give a time above zero"):
        seconds(text)


def test_lists_and_mappings():
    assert names(" x , z") == ("x", "z")
    assert by_name("x = A,z=B") == {"x": "A", "z": "B"}
    assert one_or_by_name("rate") == "rate"
    assert one_or_by_name("x=rate,z=angle") == {"x": "rate", "z": "angle"}
    for convert, text in ((names, "x,"), (names, ""), (by_name, "x"), (by_name, "x=")):
        with pytest.raises(ValueError, match="with commas between"):
            convert(text)


@pytest.mark.parametrize(
    ("text", "limits"),
    [
        ("30:90", (30.0, 90.0)),
        (":90", (None, 90.0)),
        ("30:", (30.0, None)),
        (" 1 : 2 ", (1.0, 2.0)),
    ],
)
def test_either_end_of_a_slice_may_be_left_out(text, limits):
    assert span(text) == limits


@pytest.mark.parametrize("text", ["630", "a:b", ""])
def test_a_slice_needs_two_numbers(text):
    with pytest.raises(ValueError, match="give START:STOP in s"):
        span(text)


def test_estimators_come_in_the_order_of_the_family():
    chosen = settings_of(NO_OPTIONS, estimators=("haar", "mdev", "mdev"))
    assert chosen.estimators == ("mdev", "haar")
    with pytest.raises(ValueError, match="estimators is 'adv'; use one of adev, oadev"):
        settings_of(NO_OPTIONS, estimators=("adv",))


def test_a_command_has_its_own_defaults():
    assert settings_of(NO_OPTIONS).method == "fos"
    assert settings_of(NO_OPTIONS, method="none").method == "none"
    assert settings_of(NO_OPTIONS).interval is None
    chosen = settings_of(Options(method="fris", interval=0.5, gyros=("z",)), method="none")
    assert (chosen.method, chosen.interval, chosen.gyros) == ("fris", 0.5, ("z",))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--confidence", "95"], "--confidence is 95"),
        (["--kind", "speed"], "--kind is 'speed'"),
        (["--step-4", "flat"], "--step-4 is 'flat'; use one of plain, plain-restored"),
        (["--estimator", "adv"], "--estimator is 'adv'; use one of"),
        (["--risk", "0.1"], "--risk is of a limit; give --spec, too"),
    ],
)
def test_errors_name_the_option_that_was_typed(words, said, capsys):
    assert main(["avar", "a.csv", *words]) == 2
    assert said in capsys.readouterr().err


def test_every_option_reaches_the_statement():
    options = Options(
        gyros=("x",), kind="angle", unit="counts", scale="0.1arcsec", rate=100.0, time="t:ms",
        table="a:deg", columns={"x": "A"}, slice=(1.0, None), counter_bits=16, null_pulse="n",
    )  # fmt: skip
    made = dataclasses.asdict(statement_of(options))
    assert made["sample_rate"] == options.rate
    assert made["span"] == options.slice
    same = set(made) - {"sample_rate", "span"}
    assert {name: made[name] for name in same} == {name: getattr(options, name) for name in same}
