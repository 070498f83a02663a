"""Constants of nature, each once."""

from typing import Final

EARTH_RATE: Final = 7.292115e-5
"""Earth rate, rad/s, sidereal (WGS 84)."""
