"""The top of a report, and its paragraph on methods."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

import sagnac
from sagnac.analysis.settings import Method
from sagnac.lines.published import PublishedSearch
from sagnac.noise.model_average import ModelChoice
from sagnac.report.page import page
from sagnac.report.sections import REFERENCES, TitleBlock, cited, rendered
from tests.handmade import SHA256, analysis
from tests.report.examples import checked


@pytest.mark.usefixtures("blank_figures")
def test_a_block_stands_on_top_with_file_and_hash(tmp_path):
    path = tmp_path / "unit.toml"
    path.write_text('title = "Acceptance <RLG 7>"\nserial = 42\noperator = "A. Engineer"\n')
    block = TitleBlock.from_toml(path)
    assert block.facts == [("Serial number", "42"), ("Operator", "A. Engineer")]
    html = page(analysis(), block=block)
    checked(html)
    top = html.partition('class="answer"')[0]
    for said in ("Acceptance &lt;RLG 7&gt;", "Serial number", "42", "A. Engineer", SHA256):
        assert said in top
    assert "Serial number" not in page(analysis())


def test_what_a_block_does_not_know_is_refused(tmp_path):
    path = tmp_path / "unit.toml"
    path.write_text('colour = "red"')
    with pytest.raises(ValueError, match="'colour' is not known"):
        TitleBlock.from_toml(path)


def said_of(one):
    return cited(rendered("methods.txt", analysis=one))


def test_methods_are_those_used_and_references_are_numbered_as_cited():
    pair = replace(
        analysis(), average=ModelChoice(terms=("angle_random_walk",), band_hz=(0.1, 1.0), mask=1)
    )
    paragraph = said_of(pair)["methods"]
    assert said_of(pair)["references"] == [
        REFERENCES["paper"],
        REFERENCES["ieee"],
        REFERENCES["average"],
    ]
    assert "[1]" in paragraph
    assert "differenced" in paragraph
    assert "differenced" not in said_of(analysis(gyros=("x",)))["methods"]
    assert "once a turn" in said_of(analysis(method="fris"))["methods"]
    said = {said_of(analysis(method=method))["methods"] for method in get_args(Method)}
    assert len(said) == len(get_args(Method))


@pytest.mark.parametrize(("first", "of"), [(True, "the difference"), (False, "each gyro")])
def test_the_methods_of_the_paper_say_what_lines_were_taken_off(first, of):
    paper = analysis(method="fos-paper")
    settings = replace(paper.settings, published=PublishedSearch(difference_first=first))
    assert f"taken off {of} by" in said_of(replace(paper, settings=settings))["methods"]


def test_methods_at_rest_name_no_table_and_no_differences():
    random = np.random.default_rng(4)
    rates = {name: 3.0 * random.standard_normal(6000) for name in "xyz"}
    still = sagnac.analyze(
        sagnac.Recording.from_arrays(**rates, kind="rate", unit="deg/h", sample_rate=50.0)
    )
    for one in (still, *still.each):
        said = said_of(one)["methods"]
        assert "were fitted and taken off" in said
        for word in ("table", "three-cornered", "differen"):
            assert word not in said
    # What the whole of the gyros shows stands on the page of each.
    assert "likelihood" not in said_of(still)["methods"]
    assert "likelihood" in said_of(still.each[0])["methods"]


def luminance(color: str) -> float:
    parts = [int(color[place : place + 2], 16) / 255.0 for place in (1, 3, 5)]
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.usefixtures("blank_figures")
def test_text_has_the_contrast_of_wcag_aa_in_both_themes():
    style = page(analysis()).partition("<style>")[2].partition("</style>")[0]
    blocks = [part.partition("}")[0] for part in style.split(":root {")[1:]]
    themes = [
        dict(
            item.strip().removeprefix("--").split(": ") for item in block.split(";") if "--" in item
        )
        for block in blocks
    ]
    assert len(themes) == 3  # light, dark, print
    for theme in themes:
        for name in ("ink", "soft", "blue", "amber", "green", "red"):
            colors = [
                f"#{color[1] * 2}{color[2] * 2}{color[3] * 2}" if len(color) == 4 else color
                for color in (theme[name], theme["paper"])
            ]
            bright, dark = sorted(map(luminance, colors), reverse=True)
            assert (bright + 0.05) / (dark + 0.05) >= 4.5, (name, theme)
