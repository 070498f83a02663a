"""Q, N, B, K and R: their laws, and what a curve or a spectrum says of each.

Modules, low to high: `laws` (what each term makes of a curve and a spectrum), `estimates` (what a
fit says); `likelihood` (its maximum, and where an interval ends); from a curve `curve_fit`, and
`bounds`, what it allows; from every ordinate of a spectrum `cosine_spectrum`, `lowest_ordinates`
and `fit`; from its levels `band_models` and `model_average`, with a fit of every ordinate
beside it `whole_band`; of several gyros at once `three_cornered_hat` and `cross_spectra`.
"""
