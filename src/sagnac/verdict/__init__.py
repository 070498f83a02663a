"""Limits that a gyro has to keep, and whether an interval shows that it does."""
