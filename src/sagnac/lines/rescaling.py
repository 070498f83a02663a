"""Tones that follow the table, moved to the angle scale."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sagnac import series
from sagnac.arrays import FloatArray
from sagnac.lines import _kernels
from sagnac.lines.components import Components, joined
from sagnac.lines.selection import floors
from sagnac.table.kinematics import averaged
from sagnac.table.turns import full_turns, mean_rate

if TYPE_CHECKING:
    from sagnac.lines.search import Search


def rescaled_components(search: Search) -> Components:
    """Components in time that follow the table better, moved to the angle scale.

    A tone is mixed down to zero frequency and its phase compared with the table's
    wander about its mean rate, scaled by the order it would have. At a steady rate the two are
    one, and the component stays in time.
    """
    alpha, components, steps = search.table, search.components, search.steps
    block = _kernels.MIX_BLOCK
    if alpha is None or components.frequencies.size == 0 or steps.size < 3 * block:
        return components
    length = block * max(1, series.SPAN // block)
    parts = series.each(
        lambda span: averaged(alpha[span], block), steps.size, length, release_of=(alpha,)
    )
    mean_angle = np.concatenate(list(parts))
    middles = np.arange(mean_angle.size) * block + 0.5 * (block - 1) - components.center
    number = middles - middles.mean()
    rate = float(number @ mean_angle) / float(number @ number)
    speed = abs(mean_rate(alpha, search.sample_rate)) / search.sample_rate
    if abs(rate) < 0.5 * speed:
        # A table that goes back and forth has no rate that a tone could be an order of.
        return components
    wander = mean_angle - mean_angle.mean() - rate * number
    levels = floors(components, alpha, search.left.floor)[components.orders.size :]
    spread = float(np.std(wander))
    moved = np.zeros(components.size, dtype=bool)
    orders: list[float] = []
    in_time = slice(components.orders.size, None)
    # Increments of the components: step n leads from sample n to n + 1.
    phasors = components.cosine[in_time] - 1j * components.sine[in_time]
    phasors = phasors * (np.exp(2j * np.pi * components.frequencies) - 1.0)
    for index, frequency in enumerate(components.frequencies, start=components.orders.size):
        order = 2.0 * np.pi * frequency / abs(rate)
        level = levels[index - components.orders.size]
        own = np.abs(phasors[index - components.orders.size])
        strength = own * np.sqrt(steps.size / (2.0 * level))
        if order * spread * strength < 6.0:
            continue
        mixed = _mixed_down(steps, float(frequency), components.center)
        # The component is put back, and its neighbours too: sidebands that the table's wander makes
        # of one order.
        for other in np.flatnonzero(
            np.abs(components.frequencies - frequency) < min(0.1 * frequency, 0.25 / block)
        ):
            apart = components.frequencies[other] - frequency
            mixed += 0.5 * phasors[other] * np.exp(2j * np.pi * apart * middles[: mixed.size])
        turned = mixed * np.exp(-1j * np.sign(rate) * order * wander[: mixed.size])
        if np.abs(turned.mean()) ** 2 > np.abs(mixed.mean()) ** 2 + 10.0 * level / steps.size:
            moved[index] = True
            orders.append(order)
    if not orders:
        return components
    kept = components.select(~moved)
    taken = components.select(moved)
    as_orders = np.array(orders)
    rounded = np.rint(as_orders)
    whole = np.abs(as_orders - rounded) * full_turns(alpha) < 0.5
    return joined(
        kept,
        replace(
            taken,
            orders=np.where(whole, rounded, as_orders),
            free=~whole,
            frequencies=np.empty(0),
        ),
    )


def _mixed_down(steps: FloatArray, frequency: float, center: float) -> NDArray[np.complex128]:
    """Means over blocks of the steps, mixed down from `frequency` (cycles a sample) to zero."""

    def mixed(span: slice) -> NDArray[np.complex128]:
        return _kernels.mixed_down(steps[span], frequency, center - span.start)

    length = _kernels.MIX_BLOCK * max(1, series.SPAN // _kernels.MIX_BLOCK)
    return np.concatenate(list(series.each(mixed, steps.size, length, release_of=(steps,))))
