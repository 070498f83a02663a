"""Recordings: what was measured, how good it is, and what one gyro or two give."""
