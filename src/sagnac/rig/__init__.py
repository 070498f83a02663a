"""The simulated rig: table, gyros, ring lasers, and the truth that was put in."""
