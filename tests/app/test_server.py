"""Every address of the server over the loopback: what it answers, and whom it refuses."""

import json
import os
import re
import signal
import time
import tomllib
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import sagnac
from sagnac.app import results
from sagnac.app.server import HOST
from sagnac.app.sessions import Sessions
from sagnac.cli import main
from sagnac.report.page import page as report_page
from tests import handmade
from tests.app.conftest import PAGE
from tests.processes import SAGNAC, started

OTHER = "fedcba9876543210"


def ended(process_id):
    """Whether a process is gone within five seconds."""
    for _ in range(100):
        try:
            os.kill(process_id, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def until(events, *names):
    """The next event of some names."""
    for event in events:
        if event["event"] in names:
            return event
    raise AssertionError(f"the stream ended before {names}")


def levels(html):
    """The level of each heading of a page, from the first to the last."""
    return [int(level) for level in re.findall(r"<h([1-6])\b", html)]


def test_a_page_has_one_title_and_skips_no_level_of_headings():
    """As a screen reader goes through it."""
    page = files("sagnac.app").joinpath("static/page.html").read_text(encoding="utf-8")
    for html in (page, report_page(handmade.analysis())):
        found = levels(html)
        assert found[0] == 1
        assert found.count(1) == 1
        assert max(np.diff(found)) == 1


# ---- whom it refuses ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    "path", ["/", "/wrong/", "/wrong/page.js", "/wrong/call/start", "/a/b/c/d"]
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_a_wrong_token_is_refused_at_every_address(server, method, path):
    status, text, _ = server.request(method, path, "{}" if method == "POST" else None)
    assert status in (403, 405)
    assert "still" not in text


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://example.org"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Host": "example.org"},
        {"Host": "127.0.0.1.example.org"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
@pytest.mark.parametrize(
    ("method", "name"),
    [("GET", ""), ("GET", "events"), ("POST", "call/start"), ("POST", "call/bye")],
)
def test_another_origin_and_another_host_are_refused(server, headers, method, name):
    path = f"/{server.state.token}/{name}?page={OTHER}"
    status, _, _ = server.request(method, path, "{}" if method == "POST" else None, **headers)
    assert status == 403
    assert OTHER not in server.state.sessions.open


def test_a_question_without_an_origin_is_refused(server):
    status, _, _ = server.request("POST", f"/{server.state.token}/call/start", "{}", Origin=None)
    assert status == 403


def test_the_page_and_all_that_it_loads_come_from_here(server):
    status, text, headers = server.request("GET", f"/{server.state.token}/")
    assert status == 200
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "http" not in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] == "no-referrer"
    loaded = re.findall(r'(?:src|href)="([^"#]+)"', text)
    assert len(loaded) == 5
    for name in loaded:
        if not name.startswith("data:"):
            found, script, _ = server.request("GET", f"/{server.state.token}/{name}")
            assert found == 200
            assert name.startswith("bokeh") or not re.search(r"https?://", script)


@pytest.mark.parametrize("name", ["server.py", "..", "page.jsx", "%2e%2e/server.py", "call/none"])
def test_other_files_are_not_there(server, name):
    status, _, _ = server.request("GET", f"/{server.state.token}/{name}")
    assert status in (403, 404, 405)


# ---- files -------------------------------------------------------------------------------------


def test_a_folder_is_listed(server, still):
    (server.folder / "sub").mkdir(exist_ok=True)
    (server.folder / "notes.docx").write_text("no recording")
    found = server.call("list", folder=".")
    names = [(one["name"], one["kind"]) for one in found["entries"]]
    assert ("still.parquet", "file") in names
    assert ("sub", "folder") in names
    assert "notes.docx" not in [name for name, _ in names]


@pytest.mark.parametrize("path", ["/etc/passwd", "../x.csv", "sub/../../x.csv", "", "link", "a\0b"])
def test_a_path_outside_the_folder_is_refused(server, path):
    if not (server.folder / "link").is_symlink():
        (server.folder / "link").symlink_to("/etc")
    for name, asked in (
        ("open", {"path": path, "texts": {}}),
        ("list", {"folder": path}),
        ("analyze", {"path": path, "texts": {}, "analysis": {}}),
    ):
        assert re.search("lies outside|no path", server.call(name, **asked)["error"])


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("empty.csv", b""),
        ("words.csv", b"these are words\nand more words\n"),
        ("cut.parquet", b"PAR1\0\0\0"),
        ("none.mat", b"MATLAB 5.0 MAT-file"),
        ("short.csv", b"x[deg/h]\n1\n2\n"),
    ],
)
def test_a_file_that_is_none_is_one_clear_line(server, name, content):
    (server.folder / name).write_bytes(content)
    error = server.opened(name, kind="rate", unit="deg/h", rate="10").get("error", "")
    if name == "short.csv":
        assert not error
        return
    assert name in error
    assert "\n" not in error
    assert "Traceback" not in error


def test_a_folder_without_a_campaign_is_one_plain_line(server):
    error = server.call("campaign", folder=".")["error"]
    assert error.endswith("campaign.csv cannot be read (No such file or directory)")
    (server.folder / "campaign.csv").write_bytes(b"\xff\xfe,")
    assert server.call("campaign", folder=".")["error"].endswith("(it is no table of text)")


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ({"kind": "angel"}, "angel"),
        ({"rate": "fast"}, "number"),
        ({"slice": "5"}, "START:STOP"),
        ({"wheel": "4"}, "wheel"),
        ({"columns": "x"}, "NAME=VALUE"),
        ({"unit": "furlong"}, "furlong"),
    ],
)
def test_a_text_that_states_nothing_is_one_clear_line(server, still, texts, said):
    assert said in server.opened(still, **texts)["error"]


def test_what_a_page_sends_wrong_is_one_clear_line(server, still):
    number = server.opened(still)["look"]
    for asked in (
        {"look": 10**6, "start": 0, "stop": 1, "pixels": 10},
        {"look": number, "start": 5, "stop": 5000, "pixels": 0},
        {"look": number, "start": "x", "stop": 5, "pixels": 9},
        {"look": number, "start": 9000, "stop": 9001, "pixels": 9},
    ):
        assert server.call("window", **asked)["error"]
    status, text, _ = server.request("POST", f"/{server.state.token}/call/open", "[1")
    assert (status, list(json.loads(text))) == (200, ["error"])
    _, text, _ = server.request("POST", f"/{server.state.token}/call/list", "5")
    assert json.loads(text) == {"error": "a question is a table of its arguments"}
    assert "name of its own" in server.call("start", page="x")["error"]


@pytest.mark.parametrize(
    ("texts", "analysis", "said"),
    [
        ({"bogus": "1"}, {}, "'bogus' is nothing to state; use one of gyros, columns, "),
        ({"rate": 50}, {}, "'rate' is nothing to state"),
        ({}, {"strict": "no"}, "'strict' is nothing to state; use one of method, interval, "),
    ],
)
def test_what_the_page_does_not_offer_is_refused(server, still, texts, analysis, said):
    asked = {"path": str(still), "texts": texts, "analysis": analysis}
    assert said in server.call("repeat", **asked)["error"]


# ---- a recording -------------------------------------------------------------------------------


def test_what_physics_wants_stands_beside_a_recording(server, still):
    beside = {one["what"]: one for one in server.opened(still)["beside"]}
    assert beside["mean rate of x, y, z together"]["verdict"] == "agrees"


@pytest.mark.parametrize(("gyros", "wanted"), [("xz", "at most Earth rate 15.04"), ("xyzuv", "")])
def test_gyros_that_are_no_triad_need_not_show_the_earth(server, gyros, wanted):
    random = np.random.default_rng(5)
    rates = {name: 0.1 * random.standard_normal(2000) for name in gyros}
    still = sagnac.Recording.from_arrays(**rates, kind="rate", unit="deg/h", sample_rate=100.0)
    path = sagnac.write(still, server.folder / f"{gyros}.parquet")
    together = [one for one in server.opened(path)["beside"] if "together" in one["what"]]
    assert [one["wanted"][: len(wanted)] for one in together] == [wanted] * bool(wanted)


@pytest.mark.parametrize(("share", "noted"), [(-0.5774, "agrees"), (1.5, "differs")])
@pytest.mark.parametrize("swings", [False, True])
def test_gyros_stand_beside_the_table_whether_it_turns_or_swings(server, swings, share, noted):
    time_s = np.arange(6000) / 100.0
    table = 90.0 * np.sin(2.0 * np.pi * time_s / 8.0) if swings else 40.0 * time_s
    angles = {"x": share * table, "z": 0.02 * table}
    recording = sagnac.Recording.from_arrays(
        **angles, table=table, kind="angle", unit="deg", sample_rate=100.0
    )
    path = server.folder / f"table {swings} {share}.parquet"
    beside = {one["what"]: one for one in server.opened(sagnac.write(recording, path))["beside"]}
    # At an even rate with its sign; of a swing, whose mean says nothing, by the rms.
    expected = abs(share) if swings else share
    assert float(beside["x over table rate"]["found"]) == pytest.approx(expected, rel=1e-3)
    assert beside["x over table rate"]["verdict"] == noted
    assert ("table rate, rms" in beside) == swings
    assert not any("together" in what for what in beside)


def test_a_table_at_rest_turns_nothing_however_its_encoder_scatters(server):
    random = np.random.default_rng(4)
    rates = {
        name: mean + random.standard_normal(6000)
        for name, mean in zip("xz", (9.0, 11.9), strict=True)
    }
    recording = sagnac.Recording.from_arrays(
        **rates, table=1.0 + 1e-4 * random.standard_normal(6000),
        kind="rate", unit="deg/h", sample_rate=100.0,
    )  # fmt: skip
    path = sagnac.write(recording, server.folder / "at rest.parquet")
    beside = {one["what"]: one for one in server.opened(path)["beside"]}
    assert beside["mean rate of x, z together"]["verdict"] == "agrees"
    assert not any("table" in what for what in beside)


def test_a_wrong_unit_stands_out(server):
    random = np.random.default_rng(3)
    rows = np.array([9.0, 2.0, 11.88]) + random.standard_normal((3000, 3))
    np.savetxt(server.folder / "bare.csv", rows, delimiter=",", header="x,y,z", comments="")
    right, wrong = (
        server.opened("bare.csv", kind="rate", unit=unit, rate="10")["beside"][0]
        for unit in ("deg/h", "deg/s")
    )
    assert (right["verdict"], wrong["verdict"]) == ("agrees", "differs")


def test_numbers_are_drawn_before_anything_is_stated(server):
    values = np.arange(60.0).reshape(-1, 2) % 7
    np.savetxt(server.folder / "raw.csv", values, delimiter=",", header="x,y", comments="")
    found = server.opened("raw.csv")
    assert found["raw"]
    assert found["lacking"] == {"kind": "KIND", "unit": "UNIT", "rate": "HZ"}
    drawn = server.call("window", look=found["look"], start=0, stop=30, pixels=100)["channels"]
    assert [one["low"] for one in drawn] == values.T.tolist()
    assert drawn[0]["unit"] == ""
    assert server.call("check", look=found["look"])["findings"] == []


def test_a_unit_of_the_table_that_is_still_to_be_stated_hides_no_trace(server):
    """The page itself suggests ``table_deg:UNIT``; what else is typed first is taken."""
    turned = 20.0 * np.arange(500.0) / 10.0
    rows = np.column_stack([turned, turned + 1e-3 * (np.arange(500) % 5), turned])
    named = {"delimiter": ",", "header": "x,z,table_deg", "comments": ""}
    np.savetxt(server.folder / "turning.csv", rows, **named)
    suggested = {"table": server.opened("turning.csv")["lacking"]["table"]}
    assert suggested == {"table": "table_deg:UNIT"}
    asked = server.opened("turning.csv", **suggested, kind="angle", rate="10")
    assert asked["raw"]
    assert asked["lacking"] == {**suggested, "unit": "UNIT"}
    asked = server.opened("turning.csv", **suggested, kind="angle", unit="deg", rate="10")
    assert asked["raw"]
    assert asked["lacking"] == suggested
    stated = {"kind": "angle", "unit": "deg", "rate": "10", "table": "table_deg:deg"}
    assert not server.opened("turning.csv", **stated)["raw"]


def test_a_file_that_was_written_over_is_looked_at_before_it_is_analyzed(server, still):
    place = server.folder / "replaced.parquet"
    place.write_bytes(still.read_bytes())
    given = {"path": place.name, "texts": {}, "analysis": {}}
    look = server.opened(place.name)["look"]
    run = server.call("analyze", look=look, **given)["run"]
    server.call("cancel", run=run)
    other = sagnac.Recording.from_arrays(
        x=np.random.default_rng(3).standard_normal(999), kind="rate", unit="deg/h", sample_rate=10.0
    )
    place.unlink()
    sagnac.write(other, place)
    said = server.call("analyze", look=look, **given)["error"]
    assert said.startswith(f"{place} has changed since it was read; click")
    run = server.call("analyze", look=server.opened(place.name)["look"], **given)["run"]
    server.call("cancel", run=run)
    place.unlink()


def test_a_window_is_that_of_the_samples(server, still):
    found = server.opened(still)
    values = np.degrees(sagnac.read(still)["x"].values) * 3600.0
    drawn = server.call("window", look=found["look"], start=10.0, stop=11.0, pixels=500)
    x = next(one for one in drawn["channels"] if one["name"] == "x")
    first = round(x["time"][0] * 100.0)
    np.testing.assert_allclose(x["low"], values[first : first + len(x["low"])], rtol=1e-6)
    whole = server.call("window", look=found["look"], start=0.0, stop=600.0, pixels=400)
    assert max(whole["channels"][0]["high"]) == pytest.approx(values.max(), rel=1e-6)


def test_the_spectrum_as_recorded_has_the_level_of_the_noise(server, still):
    found = server.call("spectra", look=server.opened(still)["look"])
    y = next(one for one in found["spectra"] if one["name"] == "y")
    level = 0.5 * (np.array(y["low"]) + np.array(y["high"]))
    # One-sided density of 0.003 deg/sqrt(h): sqrt(2) * 60 * N in deg/h/sqrt(Hz).
    assert np.median(level) == pytest.approx(np.sqrt(2.0) * 60.0 * 0.003, rel=0.1)
    x = found["spectra"][0]
    assert x["frequency"][int(np.argmax(x["high"]))] == pytest.approx(7.0, rel=0.03)
    counts = found["histograms"][0]
    assert sum(counts["count"]) == 60_000
    assert len(counts["edge"]) == len(counts["count"]) + 1


def test_a_finding_is_marked_at_its_time(server):
    random = np.random.default_rng(1)
    rate = random.standard_normal(6000)
    rate[2000:3000] = rate[2000]
    path = server.folder / "stuck.parquet"
    sagnac.write(
        sagnac.Recording.from_arrays(x=rate, kind="rate", unit="deg/h", sample_rate=10.0), path
    )
    found = server.call("check", look=server.opened(path)["look"])["findings"]
    assert found[0]["level"] == "error"
    assert 190.0 < found[0]["spans"][0][0] < 210.0


def test_a_dropped_file_is_opened_and_goes_with_the_server(server, still):
    status, text, _ = server.request(
        "POST", f"/{server.state.token}/drop?name=../still.parquet", still.read_bytes()
    )
    assert status == 200
    path = json.loads(text)["path"]
    assert str(server.state.room.dropped) in path
    assert server.opened(path)["samples"] == 60_000


def test_a_campaign_is_a_table(server):
    folder = server.folder / "rack"
    folder.mkdir(exist_ok=True)
    (folder / "campaign.csv").write_text("unit,n\nA,1\nB,2\n")
    assert {"name": "rack", "kind": "campaign", "size": 0} in server.call("list", folder=".")[
        "entries"
    ]
    assert server.call("campaign", folder="rack")["rows"] == [["A", "1"], ["B", "2"]]
    assert "campaign.csv" in server.call("campaign", folder="sub")["error"]


# ---- runs --------------------------------------------------------------------------------------


def test_an_analysis_tells_how_far_it_is_answers_and_is_saved(server, still):
    stream = server.events()
    asked = {"path": "still.parquet", "texts": {"gyros": "x"}, "analysis": {"spec": "1deg/sqrt(h)"}}
    number = server.call("analyze", **asked)["run"]
    assert until(stream, "progress", "failed")["stage"] == "start"
    done = until(stream, "done", "failed")
    (channel,) = done["result"]["channels"]
    assert channel["answer"]["low"] < 0.003 < channel["answer"]["high"]
    assert [round(one["hz"]) for one in channel["lines"]] == [7]
    assert done["result"]["verdict"][0]["decision"] == "pass"
    figures = channel["figures"]
    assert {"stability", "spectrum", "parts", "residual"} <= set(figures)
    assert any(one["label"].startswith("fit") for one in figures["stability"]["lines"])
    for name, what in (("stability", "interval"), ("spectrum", "band")):
        assert any(what in one["label"] for one in figures[name]["bands"])

    # A page that comes back is told again.
    again = until(server.events(), "done")
    assert again["run"] == number

    stream = server.events()
    server.call("ask", run=number, request={"ask": "verdict", "spec": "1e-9deg/sqrt(h)"})
    assert until(stream, "verdict")["verdict"][0]["decision"] == "fail"
    for lacking in ({"ask": "trial", "channel": 0}, {"ask": "trial", "channel": 7}, {"ask": "?"}):
        server.call("ask", run=number, request=lacking)
        until(stream, "failed")
    request = {"ask": "trial", "channel": 0, "off": [0], "bands": [[20.0, 30.0]]}
    server.call("ask", run=number, request=request)
    tried = until(stream, "trial", "failed")
    assert tried["asked"] == request
    assert tried["after"]["low"] < 0.003 < tried["after"]["high"]
    curves = [one["figures"]["stability"]["lines"] for one in (channel, tried)]
    after = [next(one["y"] for one in each if one["label"] == "after removal") for each in curves]
    assert max(np.array(after[1]) / np.array(after[0])) > 1.5
    script = server.call("repeat", **asked, changed=request)["script"]
    assert "left_in=lines, masked=bands" in script
    compile(script, "script", "exec")
    changed = {"channel": 0, "off": [0], "bands": []}
    for what, name in (("report", "unit 7"), ("json", "unit 7.json"), ("toml", "unit 7.toml")):
        request = {"ask": "save", "what": what, "target": name, "changed": changed}
        assert server.call("ask", run=number, request=request) == {"asked": True}
        assert until(stream, "saved", "failed")["event"] == "saved"
        assert (
            what == "report"
            or "already" in server.call("ask", run=number, request=request)["error"]
        )
    outside = {"ask": "save", "what": "json", "target": "../x.json"}
    assert "lies outside" in server.call("ask", run=number, request=outside)["error"]
    assert (server.folder / "unit 7" / "report.html").is_file()
    kept = sagnac.Analysis.from_json(server.folder / "unit 7.json")
    assert kept.angle_random_walk.to("deg/sqrt(h)").value == pytest.approx(
        channel["answer"]["value"], rel=1e-6
    )
    repeated = server.call("repeat", **asked)
    saved = (server.folder / "unit 7.toml").read_text()
    assert saved.startswith("# lines put back: 1; bands masked: none;")
    assert tomllib.loads(saved) == tomllib.loads(repeated["toml"])
    assert "lines put back" not in (server.folder / "unit 7" / "settings.toml").read_text()
    assert "--gyros x --spec '1deg/sqrt(h)'" in repeated["command"]
    process = server.state.sessions.open["abcdef0123456789"].runs[number].process
    server.call("bye", left=PAGE)
    assert ended(process.pid)


def test_an_accelerometer_is_shown_in_its_own_units():
    noise = 1e-3 * np.random.default_rng(3).standard_normal((2, 6000))
    tone = 0.01 * np.sin(2.0 * np.pi * 11.3 * np.arange(6000) / 100.0)  # of rad/s and of m/s^2
    unit = {"x": "rad/s", "ax": "m/s^2"}
    six = sagnac.Recording.from_arrays(
        x=noise[0] + tone, ax=noise[1] + tone, kind="rate", unit=unit, sample_rate=100.0
    )
    shown = results.result(sagnac.analyze(six))["channels"]
    angle = 0.01 / (200.0 * np.sin(np.pi * 0.113))  # a sample is the mean rate since the last
    for one, size, mark, rate in zip(
        shown, (648_000.0 / np.pi, 1.0), ("″", " m/s"), ("°/h", "mg"), strict=True
    ):
        (line,) = one["lines"]
        assert line["amplitude"] == pytest.approx(size * angle, rel=0.02)
        assert line["unit"] == mark
        assert (
            one["figures"]["stability"]["y"]["label"] == f"Allan deviation, {one['name']} ({rate})"
        )


def test_an_analysis_that_fails_keeps_its_reason(server, still):
    stream, page = server.events(page=OTHER), {"page": OTHER, "path": "still.parquet"}
    number = server.call("analyze", texts={"gyros": "x"}, analysis={"method": "fris"}, **page)[
        "run"
    ]
    assert "needs a turning table" in until(stream, "failed")["line"]
    session = server.state.sessions.open[OTHER]
    assert ended(session.runs[number].process.pid)
    time.sleep(0.3)
    assert "needs a turning table" in session.said[number]["line"]
    server.call("bye", page=OTHER, left=OTHER)


def test_a_wrong_limit_does_not_cost_the_answer(server, still):
    stream, page = server.events(page=OTHER), {"page": OTHER, "path": "still.parquet"}
    server.call("analyze", texts={"gyros": "x"}, analysis={"spec": "3 apples"}, **page)
    result = until(stream, "done", "failed")["result"]
    assert result["channels"][0]["answer"]["low"] < 0.003 < result["channels"][0]["answer"]["high"]
    assert result["verdict"] == []
    assert "'apples' is not a unit" in result["refused"][0]
    server.call("bye", page=OTHER, left=OTHER)


def test_the_last_four_analyses_are_kept_and_those_that_failed_do_not_count(server, still):
    stream, page = server.events(page=OTHER), {"page": OTHER, "path": "still.parquet"}

    def started(**analysis):
        return server.call("analyze", texts={"gyros": "x"}, analysis=analysis, **page)["run"]

    first = started()
    until(stream, "done", "failed")
    failed = started(method="fris")
    until(stream, "failed")
    session = server.state.sessions.open[OTHER]
    assert ended(session.runs[failed].process.pid)
    for _ in range(3):
        started()
    request = {"ask": "verdict", "spec": "1deg/sqrt(h)"}
    assert server.call("ask", page=OTHER, run=first, request=request) == {"asked": True}
    started()
    for gone in (first, failed):
        answer = server.call("ask", page=OTHER, run=gone, request=request)
        assert "the last 4 can be" in answer["error"]
    server.call("bye", page=OTHER, left=OTHER)


def test_a_triad_on_a_table_shows_each_gyro(server):
    random, time_s = np.random.default_rng(8), np.arange(6000) / 10.0
    walk = {"x": 0.02, "y": 0.02, "z": 0.04}
    arrays = {
        name: 3600.0 * 40.0 * time_s
        + one * 60.0 / np.sqrt(10.0) * np.cumsum(random.standard_normal(6000))
        for name, one in walk.items()
    }
    recording = sagnac.Recording.from_arrays(
        **arrays, table=40.0 * time_s, kind="angle", unit="arcsec", sample_rate=10.0
    )
    triad = results.result(sagnac.analyze(recording))["channels"][0]
    assert set(triad["of_each"]) == {"x", "y", "z"}
    values = {name: float(text.split()[0]) for name, text in triad["of_each"].items()}
    assert values["z"] == pytest.approx(0.04, rel=0.2)


def test_what_only_the_python_repeats_is_said_in_command_and_toml(server, still):
    asked = {"path": "still.parquet", "texts": {"gyros": "x"}, "analysis": {"method": "none"}}
    plain = server.call("repeat", **asked)
    changed = {"channel": 0, "off": [0, 2], "bands": [[20.0, 30.0]]}
    said = server.call("repeat", **asked, changed=changed)
    for name in ("command", "toml"):
        remark, _, rest = said[name].partition("\n")
        assert remark == (
            "# lines put back: 1, 3; bands masked: 20 to 30 Hz; only the Python repeats this"
        )
        assert rest == plain[name]
    assert "for number in [0, 2]]" in said["script"]
    assert "sagnac.trial" not in plain["script"]


def test_cancel_ends_the_process_and_the_other_page_keeps_its_own(server, still):
    asked = {"path": "still.parquet", "texts": {}, "analysis": {}}
    mine = server.call("analyze", **asked)["run"]
    other = server.call("analyze", page=OTHER, **asked)["run"]
    of = server.state.sessions.open
    processes = [of["abcdef0123456789"].runs[mine].process, of[OTHER].runs[other].process]
    assert server.call("cancel", page=OTHER, run=mine + 100) == {"cancelled": False}
    assert server.call("cancel", run=mine) == {"cancelled": True}
    assert ended(processes[0].pid)
    assert processes[1].is_alive()
    assert "no longer open" in server.call("ask", run=mine, request={"ask": "verdict"})["error"]
    server.call("bye", OTHER, left=OTHER)
    assert ended(processes[1].pid)
    assert OTHER not in of


def test_a_page_that_was_left_counts_as_closed_after_a_while(server):
    server.call("start", page=OTHER)
    sessions: Sessions = server.state.sessions
    sessions.forget_left()
    assert OTHER in sessions.open
    sessions.forget_left(lambda: time.monotonic() + sessions.patience + 1.0)
    assert OTHER not in sessions.open


def test_a_wrong_choice_starts_no_process(server, still):
    asked = {"path": "still.parquet", "texts": {}}
    for analysis in ({"method": "fft"}, {"confidence": "2"}, {"wheel": "1"}):
        assert server.call("analyze", analysis=analysis, **asked)["error"]


# ---- the command -------------------------------------------------------------------------------


def test_the_command_prints_one_address_and_leaves_no_process(tmp_path, still):
    process = started(*SAGNAC, "app", str(still), "--no-browser")
    try:
        address = process.stdout.readline()
        assert re.fullmatch(rf"http://{re.escape(HOST)}:\d+/[\w-]{{43}}/\n", address)
        process.send_signal(signal.SIGTERM)
        rest, said = process.communicate(timeout=20)
    finally:
        process.kill()
    assert (rest, said, process.returncode) == ("", "sagnac: stopped by SIGTERM\n", 143)


def test_without_the_extra_one_line_names_it(monkeypatch, capsys):
    monkeypatch.setattr("sagnac.app.server.find_spec", lambda name: None)
    assert main(["app", "--no-browser"]) == 1
    assert "pip install '.[app]'" in capsys.readouterr().err


def test_a_file_that_is_not_there_is_one_clear_line(tmp_path, capsys):
    for path in (tmp_path / "nosuch.csv", tmp_path / "nowhere" / "nosuch.csv"):
        assert main(["app", "--no-browser", str(path)]) == 1
        assert capsys.readouterr().err == f"sagnac: {path}: no such file; check the path\n"


def test_a_port_that_is_taken_is_one_clear_line(server, capsys):
    assert main(["app", "--no-browser", "--port", str(server.state.port)]) == 1
    assert "cannot be listened on" in capsys.readouterr().err


def test_the_room_is_at_most_2500_lines():
    room = Path(sagnac.__file__).parent / "app"
    files = [*room.glob("*.py"), *(room / "static").iterdir()]
    assert sum(len(one.read_text().splitlines()) for one in files) <= 2500
