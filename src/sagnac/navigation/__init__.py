"""Navigation with a gyro's noise: filter settings, heading from Earth rate, and what drift costs.

`models`, `settings`, `tools` and `export` write state-space models into the files of tools; `noise`
holds N, B and K of one gyro, `error_model` the error of a gyrocompass against time and latitude and
the covariance that a filter starts from, `drift` how it grows afterwards; `align` is what the door
calls. It takes what an analysis found, and knows no recordings.
"""
