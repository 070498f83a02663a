"""How a number came about, in a paragraph with references, by what the analysis did."""

from typing import Final

from sagnac.analysis.result import Analysis

REFERENCES: Final[dict[str, str]] = {
    "paper": "Yu, Wang, Wang and Wu, Sensors 2013, 13, 2750, doi:10.3390/s130302750",
    "ieee": "IEEE Std 952-1997, Annex C, and IEEE Std 647-2006, Annex C",
    "average": "Jay and Neil, Phys. Rev. D 103, 114502, 2021, arXiv:2008.01069",
}
_REMOVED: Final[dict[str, str]] = {
    "fos": "Lines that stand above the noise floor at their own frequency, in time and in table "
    "angle, were fitted together with the motion of the table and taken off; the noise that went "
    "with them was given back to the curve.",
    "fos-paper": "Lines were taken off each gyro by fast orthogonal search, as published [paper].",
    "fris": "The angle was taken once a turn of the table, so that whatever repeats with it drops "
    "out.",
    "none": "Nothing was taken off before the curve.",
}


def sentences(analysis: Analysis) -> list[str]:
    """The method, one step a sentence; references by number (see `cited`)."""
    said = []
    if analysis.gyros_differenced > 1:
        first, _, second = analysis.channel.partition("-")
        said.append(
            f"The angles of gyros {first} and {second} were differenced, so that the motion of the "
            "table drops out; coefficients and curve are per gyro, the root mean square of the two "
            "[paper]."
        )
    said.append(_REMOVED[analysis.settings.method])
    said.append(
        "The overlapping Allan deviation has intervals by chi-squared with equivalent degrees of "
        "freedom; Q, N, B, K and R are defined by IEEE [ieee]."
    )
    resting = analysis.average
    if resting is not None and resting.member == "whole band":
        said.append(
            "N rests on the likelihood of the whole spectrum, which its multitaper levels bear out."
        )
    elif resting is not None and resting.member == "both":
        said.append(
            "N comes from the likelihood of the whole spectrum. Its multitaper levels neither bear "
            "it out nor reject it, so that the interval also holds the average over bands and "
            "terms [average]."
        )
    elif resting is not None and resting.terms:
        said.append(
            "N is the average over bands of the multitaper spectrum and over the terms fitted "
            "there, weighted by how well each describes it [average]."
        )
    if resting is not None and resting.slow_terms == "low band":
        said.append(
            "B and K come from the likelihood of the lowest frequencies of the spectrum, which "
            "its multitaper levels bear out."
        )
    if analysis.per_gyro:
        said.append("N of each gyro was told apart by the three-cornered hat of the differences.")
    return said


def cited(said: list[str]) -> tuple[str, list[str]]:
    """The paragraph with numbers for references, and the references by number."""
    paragraph = " ".join(said)
    used = sorted(
        (key for key in REFERENCES if f"[{key}]" in paragraph),
        key=lambda key: paragraph.index(f"[{key}]"),
    )
    for number, key in enumerate(used, start=1):
        paragraph = paragraph.replace(f"[{key}]", f"[{number}]")
    return paragraph, [REFERENCES[key] for key in used]
