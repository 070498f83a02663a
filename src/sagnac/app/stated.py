"""Statements on a file as the page holds them: option -> text, in words of the command line.

The same texts become a `sagnac.Statement`, a command, lines of Python and a TOML.
"""

import json
import shlex
from collections.abc import Mapping
from typing import Any, Final

import sagnac

READING: Final = (
    "gyros", "columns", "kind", "unit", "scale", "rate", "time", "table", "slice",
    "counter_bits", "counter_period", "null_pulse", "accelerometers", "layout",
)  # fmt: skip
"""Options that say how a file is read."""

ANALYSIS: Final = ("method", "interval", "confidence", "covariates", "accept", "spec")
"""Options that say how a recording is analyzed."""

Texts = Mapping[str, str]


def cleaned(texts: Mapping[str, Any], known: tuple[str, ...]) -> dict[str, str]:
    """The texts that are not empty, in the order of the options.

    ValueError if there is an option of another name, or a value is no text.
    """
    for name, text in texts.items():
        if name not in known or not isinstance(text, str):
            raise ValueError(f"{name!r} is nothing to state; use one of {', '.join(known)}")
    return {name: texts[name].strip() for name in known if texts.get(name, "").strip()}


def reads(reading: Texts, analysis: Texts) -> dict[str, Any]:
    """The keywords of `sagnac.read`; a covariate is a column of its name.

    ValueError if a text is none of its option.
    """
    found = sagnac.keywords(reading)
    for one in choices(analysis).get("covariates", ()):
        found["columns"] = {one: one, **found.get("columns", {})}
    return found


def choices(texts: Texts) -> dict[str, Any]:
    """The keywords of `sagnac.analyze`; a specification is not among them: `sagnac.judge` takes it.

    ValueError if a value cannot be.
    """
    return sagnac.keywords({name: text for name, text in texts.items() if name != "spec"})


def line(error: BaseException) -> str:
    """An error in one line."""
    if isinstance(error, sagnac.RecordingError):
        return error.line(lambda name, value: f"{name} {value}".strip())
    if isinstance(error, KeyError):
        return f"{error.args[0]} is missing, or no longer open; load the page again"
    return " ".join(str(error).split()) or type(error).__name__


def remark(changed: Mapping[str, Any] | None) -> str:
    """A comment that names lines put back and bands masked, for texts which cannot repeat them."""
    if not changed:
        return ""
    lines = ", ".join(str(int(one) + 1) for one in changed["off"]) or "none"
    bands = [f"{float(low):.6g} to {float(high):.6g} Hz" for low, high in changed["bands"]]
    changes = f"lines put back: {lines}; bands masked: {', '.join(bands) or 'none'}"
    return f"# {changes}; only the Python repeats this\n"


def command(path: str, reading: Texts, analysis: Texts) -> str:
    """The command that repeats a run."""
    words = ["sagnac", "analyze", shlex.quote(path)]
    for name, text in {**reading, **analysis}.items():
        words += [f"--{name.replace('_', '-')}", shlex.quote(text)]
    return " ".join([*words, "-o", "report"])


def script(path: str, reading: Texts, analysis: Texts, changed: Mapping[str, Any] | None) -> str:
    """The Python that repeats a run, and the lines put back and bands masked after it."""

    def keywords(found: Mapping[str, Any]) -> str:
        return "".join(f", {name}={value!r}" for name, value in found.items())

    lines = [
        "import sagnac",
        "",
        f"recording = sagnac.read({path!r}{keywords(reads(reading, analysis))})",
        f"analysis = sagnac.analyze(recording{keywords(choices(analysis))})",
        "for each in analysis.each:",
        '    print(each.channel, each.angle_random_walk.to("deg/sqrt(h)"))',
    ]
    if "spec" in analysis:
        lines.append(f"print(sagnac.judge(analysis, {analysis['spec']!r}).by_gyro)")
    lines.append('sagnac.write_report(analysis, "report")')
    if changed:
        place, off, bands = (changed[name] for name in ("channel", "off", "bands"))
        lines += [
            f"one = (*analysis.each, *analysis.accelerometers.values())[{int(place)}]",
            f"lines = [one.lines[number] for number in {[int(one) for one in off]}]",
            f"bands = {[(float(low), float(high)) for low, high in bands]}  # Hz",
            "tried = sagnac.trial(one, left_in=lines, masked=bands)",
            'print(tried.angle_random_walk.to("deg/sqrt(h)"))',
        ]
    return "\n".join(lines) + "\n"


def toml(reading: Texts, analysis: Texts) -> str:
    """The TOML that ``sagnac analyze FILE --settings`` takes: each option as it is typed."""
    stated = {**reading, **analysis}
    typed = {name: json.dumps(text, ensure_ascii=False) for name, text in stated.items()}
    return "".join(f"{name} = {text}\n" for name, text in typed.items())
