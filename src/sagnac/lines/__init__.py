"""Periodic components in table angle and in time: found, fitted together, named and removed."""
