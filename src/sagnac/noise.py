"""The noise a gyro makes: Q, N, B, K, R, their Allan variance and their spectrum."""

from typing import Final, Literal

CoefficientName = Literal[
    "quantization", "angle_random_walk", "bias_instability", "rate_random_walk", "rate_ramp"
]
COEFFICIENT_NAMES: Final[tuple[CoefficientName, ...]] = (
    "quantization",
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
    "rate_ramp",
)
