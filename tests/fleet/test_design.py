import numpy as np
import pytest

from tests.fleet.examples import CELLS, DYESTUFF, design_of


def test_contrasts_of_a_balanced_design_are_its_classical_degrees_of_freedom() -> None:
    labels = {
        name: tuple(str(cell[place]) for cell in CELLS)
        for place, name in enumerate(("unit", "day", "rate"))
    }
    design = design_of(np.arange(36.0), labels)
    assert [design.contrasts(name).shape[1] for name in labels] == [2, 2, 3]
    assert design.contrasts("run").shape[1] == 36 - 1 - 2 - 2 - 3
    for name in labels:
        contrasts = design.contrasts(name)
        assert np.abs(contrasts.sum(axis=0)).max() < 1e-12
        for other in set(labels) - {name}:
            assert np.abs(contrasts.T @ design.incidence(other)).max() < 1e-12


def test_sum_of_squares_between_batches_is_the_textbook_one() -> None:
    between = DYESTUFF.contrasts("batch").T @ DYESTUFF.values
    within = DYESTUFF.contrasts("run").T @ DYESTUFF.values
    assert between @ between == pytest.approx(56357.5)
    assert within @ within == pytest.approx(58830.0)


def test_factors_that_cannot_be_told_apart_are_hidden_with_the_reason() -> None:
    labels = ("a", "a", "b", "b", "c", "c")
    design = design_of(np.arange(6.0), {"unit": labels, "day": labels, "rate": ("10",) * 6})
    assert design.seen == ()
    assert "only together" in design.hidden["unit"]
    assert design.hidden["rate"] == "all runs are of one rate"
