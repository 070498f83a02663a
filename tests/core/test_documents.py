"""``analysis.json`` against its schema: what is written keeps it, what is edited is told."""

import copy
import json
from collections.abc import Iterator
from importlib.resources import files

import pytest

from sagnac.analysis.result import Analysis
from sagnac.cli import main
from sagnac.core.documents import ANALYSIS, check_analysis, documents_of, read_analyses
from sagnac.core.errors import RecordingError
from sagnac.navigation.noise import GyroNoise
from sagnac.report.document import analysis_document, many_document
from tests.handmade import analysis
from tests.report.examples import CASES

ODD = ([], {}, None, "", "x", -1.0, 0, 1e308, 1e-308, True, [[]], [None], {"a": 1}, "nan")


@pytest.mark.parametrize("made", CASES.values(), ids=CASES.keys())
def test_what_is_written_keeps_the_schema(made):
    check_analysis(json.loads(json.dumps(analysis_document(made))))


def published():
    return json.loads(files("sagnac").joinpath("analysis-1.schema.json").read_text("utf-8"))


@pytest.mark.parametrize("made", CASES.values(), ids=CASES.keys())
def test_every_key_that_is_written_stands_in_the_schema(made):
    document, known = analysis_document(made), published()["properties"]
    assert set(document) <= set(known)
    assert set(document["input"]) <= set(known["input"]["properties"])


def test_the_schema_is_published_with_its_version():
    schema = published()
    assert schema["properties"]["schema"] == {"const": ANALYSIS}
    contract = {
        "input", "settings", "angle_random_walk", "coefficients", "estimates", "lines", "curve",
        "notes", "seconds",
    }  # fmt: skip
    assert contract <= set(schema["required"])
    assert schema.get("additionalProperties", True) is True


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda it: it["curve"].update(tau_s=[]), "curve.tau_s must contain at least 1 items"),
        (lambda it: it["curve"].update(edf=[0.0]), "curve.edf"),
        (lambda it: it["curve"].update(terms=[1.5]), "curve.terms"),
        (lambda it: it.update(curves=[{}]), "must contain"),
        (lambda it: it["curve"].update(deviation_deg_per_h=["1"]), "must be number"),
        (lambda it: it["input"].update(sample_rate_hz=0), "sample_rate_hz must be bigger than 0"),
        (lambda it: it["angle_random_walk"].update(unit="deg/h"), "angle_random_walk.unit"),
        (lambda it: it["angle_random_walk"].update(value=-1.0), "angle_random_walk"),
        (lambda it: it["angle_random_walk"].update(status="sure"), "status must be one of"),
        (lambda it: it["coefficients"].update(quantization=3), "quantization must be object"),
        (lambda it: it.update(per_gyro=[]), "per_gyro must be object"),
        (lambda it: it.pop("curve"), "must contain"),
        (lambda it: it.update(accelerometers={"ax": {}}), "must contain"),
        (lambda it: it.update(accelerometers=[]), "accelerometers must be object"),
        (lambda it: it.update(low_pass={"corner_hz": 40.0}), "must contain"),
        (lambda it: it.update(low_pass={"corner_hz": 0.0, "order": 1}), "must be bigger than 0"),
        (lambda it: it.update(slow_noise={"markov": {"deviation": {}}}), "must contain"),
    ],
)
def test_an_edited_document_is_told_where(change, said, tmp_path):
    document = json.loads(json.dumps(analysis_document(analysis())))
    change(document)
    path = tmp_path / "analysis.json"
    path.write_text(json.dumps(document))
    with pytest.raises(RecordingError, match=r"breaks its schema sagnac\.analysis/1: ") as caught:
        read_analyses(path)
    assert said in str(caught.value)
    with pytest.raises(RecordingError):
        GyroNoise.unit(path)


@pytest.mark.parametrize("content", ["", "{", "NaN", "[" * 100_000, '{"schema": NaN}', "\x00"])
def test_what_is_no_json_is_told(content, tmp_path):
    path = tmp_path / "analysis.json"
    path.write_text(content)
    with pytest.raises(RecordingError, match="is no JSON"):
        read_analyses(path)


def test_several_analyses_are_read_one_by_one(tmp_path):
    path = tmp_path / "analyses.json"
    path.write_text(json.dumps(many_document([analysis(), analysis()])))
    assert len(read_analyses(path)) == 2
    path.write_text(json.dumps({"schema": "sagnac.analyses/1", "analyses": []}))
    with pytest.raises(RecordingError, match="holds no analyses"):
        read_analyses(path)


def places(value: object, path: tuple[object, ...] = ()) -> Iterator[tuple[object, ...]]:
    """Every place of a document, one of the items of each list."""
    yield path
    if isinstance(value, dict):
        for key, item in value.items():
            yield from places(item, (*path, key))
    elif isinstance(value, list) and value:
        yield from places(value[0], (*path, 0))


def edited(document: dict, place: tuple[object, ...], value: object) -> dict:
    """The document with another value at a place."""
    changed = copy.deepcopy(document)
    *above, last = place
    holder = changed
    for key in above:
        holder = holder[key]
    holder[last] = value
    return changed


@pytest.mark.parametrize("readers", [1, pytest.param(2, marks=pytest.mark.fuzz)])
def test_every_value_may_be_edited_and_no_command_fails_inside(readers, tmp_path, capsys):
    """Each place that is read in turn, an odd value of those above into one reader or either."""
    document = json.loads(json.dumps(analysis_document(analysis(gyros=("x", "y", "z")))))
    unread = ("estimates", "shares", "triad", "lines", "parts", "findings", "seconds", "notes")
    path, wrong = tmp_path / "analysis.json", []
    read = [one for one in places(document) if one and (len(one) == 1 or one[0] not in unread)]
    read = [one for one in read if "units" not in one[:-1]]
    for number, place in enumerate(read):
        both = [
            (0, ["export", str(path), "-o", str(tmp_path / "imu.toml")]),
            (5, ["align", str(path), "--latitude", "32", "--json"]),
        ]
        for offset, words in both if readers == 2 else both[number % 2 :][:1]:
            value = ODD[(number + offset) % len(ODD)]
            path.write_text(json.dumps(edited(document, place, value)))
            status, said = main(words), capsys.readouterr().err
            sound = not said if status == 0 else said.count("\n") == 1
            if status not in (0, 1) or "internal error" in said or not sound:
                wrong.append((words[0], place, value, said))
    assert wrong == []


def test_the_text_of_a_document_is_taken_as_its_file_is(tmp_path):
    made = analysis()
    text = made.to_json(tmp_path / "analysis.json")
    of_file = Analysis.from_json(tmp_path / "analysis.json")
    assert Analysis.from_json(text).to_json() == of_file.to_json()
    with pytest.raises(RecordingError, match="text: is no JSON"):
        Analysis.from_json("{")


def test_a_value_that_no_rule_allows_is_shown():
    document = analysis_document(analysis())
    document["settings"]["interval_s"] = "x"
    with pytest.raises(ValueError, match=r"settings.interval_s is 'x', which it does not allow"):
        check_analysis(document)


def test_reports_that_are_no_longer_of_a_campaign_are_left_out(tmp_path):
    for name in ("A-1234", "B-5678"):
        (tmp_path / "reports" / name).mkdir(parents=True)
        (tmp_path / "reports" / name / "analysis.json").write_text("{}")
    assert len(documents_of(tmp_path)) == 2
    (tmp_path / "campaign.csv").write_text("file,report\nB.csv,reports/B-5678\n")
    assert [one.parent.name for one in documents_of(tmp_path)] == ["B-5678"]
