"""Navigation with a gyro's noise: heading found from Earth rate, and what drift costs.

`noise` holds N, B and K of one gyro, `error_model` the error of a gyrocompass against time and
latitude and the covariance that a filter starts from, `drift` how it grows afterwards; `align` is
what the door calls.
"""
