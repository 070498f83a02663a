"""Greedy search for pairs of sine and cosine, as its definition reads: least squares each time.

Slow on purpose, and free of anything from the package it judges.
"""

import numpy as np


def mean_square_left(columns, signal):
    """Mean square of `signal` beside its least-squares combination of `columns`."""
    solution = np.linalg.lstsq(np.column_stack(columns), signal, rcond=None)[0]
    return float(np.mean((signal - np.column_stack(columns) @ solution) ** 2))


def is_new(columns, candidate):
    """Whether the columns leave enough of a candidate."""
    left = mean_square_left(columns, candidate)
    return left > max(1e-6 * float(np.mean(candidate**2)), 1e-7)


def greedy_pairs(phase, signal, *, spacing, candidates, bound, most_terms):
    """Frequencies in the order chosen, mean squares, and coefficients of the last fit.

    `bound` is the least share of the mean square left that a pair has to bring. A candidate
    is passed over when its cosine, its sine, or its sine beside its cosine is made up of the
    columns to within 1e-6 of its power, or to a mean square of 1e-7.
    """
    columns = [np.ones_like(phase), phase]
    left = [mean_square_left(columns, signal)]
    chosen = []
    while len(chosen) < most_terms:
        best, least = None, left[-1]
        for k in range(1, candidates + 1):
            if k in chosen:
                continue
            cosine, sine = np.cos(k * spacing * phase), np.sin(k * spacing * phase)
            if not (is_new(columns, cosine) and is_new(columns, sine)):
                continue
            # Beside its cosine, as a share of what of the sine is new beside the rest.
            if mean_square_left([*columns, cosine], sine) < 1e-6 * mean_square_left(columns, sine):
                continue
            after = mean_square_left([*columns, cosine, sine], signal)
            if after < least:
                best, least = k, after
        if best is None or left[-1] - least <= bound * left[-1]:
            break
        chosen.append(best)
        columns += [np.cos(best * spacing * phase), np.sin(best * spacing * phase)]
        left.append(least)
    solution = np.linalg.lstsq(np.column_stack(columns), signal, rcond=None)[0]
    return chosen, np.array(left), solution
