"""Inputs as text."""

import tomllib

import pytest

import sagnac
from sagnac.core.texts import text_of, toml_table, value_of

TYPED = {
    "gyros": "x,z", "columns": "x=A,z=B c", "kind": "x=rate,z=angle", "unit": "deg/h",
    "scale": "0.1arcsec", "rate": "123.456789012", "time": "t:s", "slice": "630:", "table": "none",
    "counter_bits": "16", "accelerometers": "none", "interval": "100ms", "confidence": "0.9",
    "accept": "clipping,spikes", "spec": "0.003deg/sqrt(h)",
}  # fmt: skip


def test_what_is_typed_are_the_keywords_of_the_library():
    assert sagnac.keywords(TYPED) == {
        "gyros": ("x", "z"), "columns": {"x": "A", "z": "B c"}, "kind": {"x": "rate", "z": "angle"},
        "unit": "deg/h", "scale": "0.1arcsec", "sample_rate": 123.456789012, "time": "t:s",
        "span": (630.0, None), "table": "none", "counter_bits": 16, "accelerometers": ("none",),
        "interval": 0.1, "confidence": 0.9, "accepted": ("clipping", "spikes"),
        "specification": "0.003deg/sqrt(h)",
    }  # fmt: skip


def test_a_value_is_typed_as_it_was_read():
    for option, text in TYPED.items():
        value = value_of(option, text)
        assert value_of(option, text_of(value)) == value


@pytest.mark.parametrize(
    ("option", "text"),
    [("rate", "fast"), ("slice", "5"), ("columns", "x"), ("counter-bits", "4.5"), ("gyros", "x,")],
)
def test_a_text_that_is_none_of_its_option_is_refused_by_name(option, text):
    with pytest.raises(ValueError, match=rf"^{option.replace('-', '_')} is '{text}'; give "):
        sagnac.keywords({option: text})


def test_what_is_missing_reads_the_file_as_it_is_given(tmp_path):
    path = tmp_path / "bench.csv"
    path.write_text("stamp,gyro_x[deg/s]\n" + "0.00,1.5\n0.01,1.6\n" * 4)
    lacking = sagnac.missing(path)
    assert lacking["columns"] == "x=gyro_x[deg/s]"
    path.write_text("stamp,gyro_x[deg/s]\n" + "".join(f"{n / 100},{n % 7}\n" for n in range(200)))
    recording = sagnac.read(path, **sagnac.keywords(lacking))
    assert [gyro.name for gyro in recording.gyros] == ["x"]
    assert recording.sample_rate == pytest.approx(100.0)


def test_a_table_is_read_back_from_its_toml():
    table = {"gyros": ("x", "z"), "unit": {"x y": 'a"b'}, "rate": 100.5, "strict": True, "n": 3}
    assert tomllib.loads(toml_table(table)) == {**table, "gyros": ["x", "z"]}
