"""Recordings: what was measured, how good it is, and what one gyro or two give.

Low to high, each module importing only from those above it in this list:

- `channel`: one column in SI, what one sample of it is, and the way from rate and increment to
  angle. `stamps`: the rate that time stamps give, and stretches of samples. `effects`: what a
  finding does to N.
- `encoder_readings`, `columns`: names and columns as channels, and the table's angle.
- `model`: the recording.
- `profile`: how the noise runs through it.
- `readout`, `distribution`, `gaps`, `encoder_faults`, `repeats`, `spikes`, `physics`: detectors,
  each with the faults that it sees.
- `quality`: all of these.
"""
