"""Recordings: what was measured, how good it is, and what one gyro or two give.

Low to high, each module importing only from those above it in this list:

- `channel`: one column in SI; what one sample of it is.
- `stamps`: the rate that time stamps give. `kinds`: from rate and increment to angle.
  `unwrapping`: readings that start over, made continuous. `stretches`: samples for which something
  holds. `difference`: one gyro from two.
- `encoder`: readings made the angle of a table, missing ones interpolated.
- `columns`, `frames`: columns of numbers, and of frames, as channels.
- `model`: the recording.
- `readout`: the step that an angle is read out in. `soundness`: the stretch to take instead.
- `stuck`, `jumps`, `saturation`, `not_finite`, `encoder_mismatch` (an encoder that does not follow
  its gyros), `wrong_unit`, `gaps` (and late stamps): one fault each.
- `quality`: all of these.
"""
