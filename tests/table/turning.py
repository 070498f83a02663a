"""Tables that turn, and what a gyro on them senses, integrated finely."""

import numpy as np
from scipy.integrate import cumulative_simpson

ARCSECOND = np.pi / 648_000
EARTH = 7.292115e-5
TURN = 2.0 * np.pi

RATE = 100.0
SHARE, DRIFT, EARTH_TERMS = 2.1e-3, 2.5e-6, (3.1e-5, -2.2e-5)


def motion(speed):
    """Table angle (fine and at the samples) from a speed on a grid eight times as fine."""
    fine = np.concatenate([[0.0], cumulative_simpson(speed, dx=1.0 / (8.0 * RATE))]) + 0.7
    return fine, fine[::8]


def sensed(fine, *, share=SHARE, drift=DRIFT, earth=EARTH_TERMS):
    """Gyro angle along a motion: the rates integrated by Simpson's rule."""
    rate = drift + earth[0] * np.cos(fine) + earth[1] * np.sin(fine)
    integral = np.concatenate([[0.0], cumulative_simpson(rate, dx=1.0 / (8.0 * RATE))])
    return share * (fine - fine[0])[::8] + integral[::8]


def time(seconds):
    return np.arange(round(seconds * RATE * 8) + 1) / (8.0 * RATE)


def wandering(seconds):
    t = time(seconds)
    return np.radians(40.0) * (1.0 + 0.1 * np.sin(t / 37.0) + 0.05 * np.cos(t / 11.0))


def reversing(seconds, period=60.0):
    # Full speed either way, a second to turn round.
    return np.radians(40.0) * np.clip(15.0 * np.sin(TURN * time(seconds) / period), -1.0, 1.0)
