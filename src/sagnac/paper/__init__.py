"""The paper's experiment (Yu et al., *Sensors* 2013, 13, 2750), regenerated on the simulated rig.

`trials` holds its fit and what might explain Figure 3, `prediction` its numbers, the runs and the
choice of table rate. `reproduce` makes them all, `tables` and `page` show them beside the paper's.
"""
