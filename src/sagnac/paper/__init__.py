"""The paper's experiment (Yu et al., *Sensors* 2013, 13, 2750), regenerated on the simulated rig.

`published` holds its numbers and `least_squares` its fit. `trials` and `plan` say what is
simulated, `outcome` is one run, and `reproduce` makes them all. `prediction` is the choice of
table rate.
"""
