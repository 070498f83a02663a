"""Q, N, B, K and R: their laws, and what a curve or a spectrum says of each.

Modules, low to high: `laws` (what each term makes of a curve and a spectrum), `estimates` (what a
fit says), `limits` (where an interval ends); from a curve `curve_fit`; from every ordinate of a
spectrum `cosine_spectrum`, `maximum`, `ramp` and `fit`; from its levels `band_models`,
`mixture` and `model_average`, and `whole_band` for both together; of three gyros at once
`three_cornered_hat`.
"""
