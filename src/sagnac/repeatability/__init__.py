"""How N scatters over units, days, rates and runs, and what the next one will show.

`design` says which runs share what, estimates the variances and draws them for intervals that hold
at few degrees of freedom; `study` looks ahead and at single runs, and puts the answer together in
terms of N.
"""
