"""Which peaks are lines and which wait: against a definition told candidate by candidate."""

import numpy as np
import pytest

from sagnac.lines.candidates import PEAKS_A_ROUND, Candidates, strongest

SAMPLES = 10_000
BIN = 1.0 / SAMPLES


def candidates(*rows):
    """Rows of (scale, place in bins, height, sweep in bins); "order" or "broken" are in angle."""
    scale, place, height, sweep = zip(*rows, strict=True)
    place, sweep = np.array(place, dtype=float), np.array(sweep, dtype=float)
    return Candidates(
        place=2.0 * place,
        in_angle=np.array([one != "tone" for one in scale]),
        broken=np.array([one == "broken" for one in scale]),
        height=np.array(height, dtype=float),
        low=(place - sweep - 1.5) * BIN,
        high=(place + sweep + 1.5) * BIN,
        samples=SAMPLES,
    )


# --- the definition --------------------------------------------------------------------------


def meets(c, a, b):
    """Whether two on different scales sweep some of the same frequencies."""
    return c.in_angle[a] != c.in_angle[b] and c.low[a] < c.high[b] and c.low[b] < c.high[a]


def leak(c, source, at):
    """Height of one's leakage at another."""
    if meets(c, source, at):
        return 0.0
    if c.in_angle[source] == c.in_angle[at]:
        bins = abs(c.place[source] - c.place[at]) / 2.0
    else:
        gap = max(c.low[at] - c.high[source], c.low[source] - c.high[at])
        widest = max(c.high[i] - c.low[i] for i in (source, at)) * c.samples
        bins = gap * c.samples / max(widest / 100.0, 1.0)
    return c.height[source] / (np.pi * max(bins, 1.0)) ** 2


def is_image(c, source, at):
    """Whether a line is high enough to make another on the other scale."""
    cells = max(c.high[i] - c.low[i] for i in (source, at)) * c.samples
    return meets(c, source, at) and c.height[at] < 30.0 * c.height[source] / cells


def is_same(c, source, at):
    return c.in_angle[source] == c.in_angle[at] and abs(c.place[source] - c.place[at]) < 3.0


def naive(c):
    """Verdict on each candidate, from those on all that are higher."""
    verdicts = {}
    for at in sorted(range(c.place.size), key=lambda i: -c.height[i]):
        higher = {i: v for i, v in verdicts.items() if v != "claimed"}
        plain = [i for i, v in higher.items() if "hidden" not in v]
        if any(is_same(c, i, at) for i in plain) or any(
            v == "chosen" and is_image(c, i, at) for i, v in higher.items()
        ):
            verdicts[at] = "claimed"
            continue
        hidden = c.height[at] < 10.0 * sum(leak(c, i, at) for i in plain)
        held = any(meets(c, i, at) for i in higher)
        some_wait = any(verdicts[i] == "held" for i in plain)
        held = held or (bool(c.broken[at]) and some_wait)
        if hidden:
            verdicts[at] = "hidden, held" if held else "hidden"
        else:
            verdicts[at] = "held" if held else "chosen"
    return [verdicts[at] for at in range(c.place.size)]


@pytest.mark.parametrize("seed", range(40))
def test_the_strongest_are_those_of_the_definition(seed):
    generator = np.random.default_rng([seed, 20])
    size = int(generator.integers(2, 40))
    one = candidates(
        *zip(
            generator.choice(["tone", "order", "broken"], size),
            generator.uniform(10.0, 400.0, size),
            np.exp(generator.uniform(3.0, 14.0, size)),
            generator.choice([0.0, 1.0, 30.0], size),
            strict=True,
        )
    )
    verdicts = naive(one)
    lines, waiting = strongest(one)
    assert lines.tolist() == [verdict == "chosen" for verdict in verdicts]
    # What is hidden and meets another on the other scale, be it weaker, is still to come, unless
    # a line or one that waits in plain sight has claimed it since.
    others = [i for i, verdict in enumerate(verdicts) if verdict != "claimed"]
    plain = [i for i in others if "hidden" not in verdicts[i]]
    left = [
        i
        for i in others
        if "hidden" in verdicts[i]
        and ("held" in verdicts[i] or any(meets(one, j, i) for j in others))
        and not any(is_same(one, j, i) for j in plain)
        and not any(verdicts[j] == "chosen" and is_image(one, j, i) for j in plain)
    ]
    assert waiting == bool(left)


# --- one rule at a time ----------------------------------------------------------------------


def chosen(*rows):
    return np.flatnonzero(strongest(candidates(*rows))[0]).tolist()


def test_lines_far_apart_are_all_chosen():
    assert chosen(("tone", 50, 100.0, 0), ("tone", 300, 100.0, 0), ("order", 700, 50.0, 2)) == [
        0,
        1,
        2,
    ]


def test_a_sidelobe_is_no_line_and_ten_times_as_much_is_one():
    # Five bins off, leakage is 1 / (5 pi)^2 = 0.4 % of the height.
    assert chosen(("tone", 50, 1e6, 0), ("tone", 55, 3e4, 0)) == [0]
    assert chosen(("tone", 50, 1e6, 0), ("tone", 55, 5e4, 0)) == [0, 1]


def test_two_tops_of_one_peak_are_one_line():
    assert chosen(("tone", 50, 1e3, 0), ("tone", 51, 9e2, 0)) == [0]
    assert chosen(("tone", 50, 1e3, 0), ("tone", 52, 9e2, 0)) == [0, 1]


def test_the_image_of_a_line_on_the_other_scale_is_no_line_and_keeps_none_waiting():
    # An order that sweeps 60 bins has half of its height in one of them at the most.
    rows = [("order", 100, 1e5, 30), ("tone", 110, 1e3, 0), ("order", 300, 50.0, 0)]
    assert chosen(*rows) == [0, 2]
    assert not strongest(candidates(*rows))[1]


def test_what_is_too_high_for_an_image_waits_until_the_stronger_one_is_out():
    assert chosen(("order", 100, 1e5, 30), ("tone", 110, 9e4, 0)) == [0]
    # And a weaker image of what waits is no surer: the order at 150 sweeps the tone's place.
    rows = [("order", 100, 1e5, 30), ("tone", 110, 9e4, 0), ("order", 112, 8e4, 1)]
    assert chosen(*rows) == [0]


def test_broken_orders_wait_while_any_other_waits():
    rows = [("order", 100, 1e5, 30), ("tone", 110, 9e4, 0), ("broken", 700, 5e3, 0)]
    assert chosen(*rows) == [0]
    assert chosen(rows[0], rows[2]) == [0, 1]
    whole = [*rows[:2], ("order", 700, 5e3, 0)]
    assert chosen(*whole) == [0, 2]


def test_a_round_has_its_fill():
    rows = [("tone", 10 * n, 100.0 + n, 0) for n in range(1, PEAKS_A_ROUND + 50)]
    assert len(chosen(*rows)) == PEAKS_A_ROUND


def test_candidates_without_any_are_none():
    empty = np.empty(0)
    none = Candidates(
        place=empty,
        in_angle=np.empty(0, dtype=bool),
        broken=np.empty(0, dtype=bool),
        height=empty,
        low=empty,
        high=empty,
        samples=SAMPLES,
    )
    assert strongest(none)[0].size == 0
