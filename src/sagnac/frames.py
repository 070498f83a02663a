"""Frames of the platform: C_b^s, Earth rate, and the ideal observation model, Eqs. 1-7."""
