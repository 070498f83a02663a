"""Limits that a gyro has to keep, and whether an interval shows that it does.

The room knows estimates and their laws, not the analysis or the recording that they come from.
"""
