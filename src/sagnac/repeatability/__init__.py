"""How N scatters over units, days, rates and runs, and what the next one will show.

`design` says which runs share what, `restricted` estimates the variances, `fiducial` draws them
for intervals that hold at few degrees of freedom, `prediction` looks ahead, `outliers` looks at
single runs and `study` puts the answer together in terms of N.
"""
