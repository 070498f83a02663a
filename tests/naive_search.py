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


def textbook_search(signal, base, candidates, *, terms):
    """Korenberg's fast orthogonal search over single terms, as the paper's Eqs. 17-19 read.

    `base` are the functions that are always in, first a column of ones; `candidates` the columns
    to choose from. Returns the candidates chosen, the mean squares left, and the coefficients of
    the base and of the chosen terms.
    """
    functions = list(base)

    def recursion(functions):
        """alpha, D(m, m), C(m) of the functions in turn; nothing but means of products."""
        count = len(functions)
        own, alpha, shared = np.zeros((count, count)), np.zeros((count, count)), np.zeros(count)
        for m in range(count):
            for r in range(m + 1):
                own[m, r] = np.mean(functions[m] * functions[r])
                for i in range(r):
                    own[m, r] -= alpha[r, i] * own[m, i]
                if r < m:
                    alpha[m, r] = own[m, r] / own[r, r]
            shared[m] = np.mean(signal * functions[m])
            for r in range(m):
                shared[m] -= alpha[m, r] * shared[r]
        return alpha, np.diag(own), shared

    def merit(functions):
        _, own, shared = recursion(functions)
        return shared[-1] ** 2 / own[-1]

    _, own, shared = recursion(functions)
    left = [float(np.mean(signal**2) - np.sum(shared**2 / own))]
    chosen = []
    for _ in range(terms):
        free = [k for k in range(candidates.shape[1]) if k not in chosen]
        merits = [merit([*functions, candidates[:, k]]) for k in free]
        best = int(np.argmax(merits))
        chosen.append(free[best])
        functions.append(candidates[:, free[best]])
        left.append(left[-1] - merits[best])
    alpha, own, shared = recursion(functions)
    weights = shared / own
    coefficients = np.zeros(len(functions))
    for m in range(len(functions)):
        v = np.zeros(len(functions))
        v[m] = 1.0
        for i in range(m + 1, len(functions)):
            v[i] = -sum(alpha[i, r] * v[r] for r in range(m, i))
        coefficients[m] = np.sum(weights * v)
    return chosen, np.array(left), coefficients
