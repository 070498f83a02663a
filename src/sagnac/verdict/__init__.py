"""Limits that a gyro has to keep, whether an interval shows that it does, and how long that takes.

The room knows estimates and their laws, not the analysis or the recording that they come from.
"""
