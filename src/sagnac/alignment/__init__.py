"""Navigation with a gyro's noise: heading found from Earth rate, and what drift costs.

`noise` holds N, B and K of one gyro, `initial` the covariance that a filter starts from, `azimuth`
the error of a gyrocompass against time and latitude, and `position` how it grows afterwards.
"""
