"""A recording: channels, what one sample of them is, when they were read, and the table's angle.

Low to high: `channel` (one column in SI, and the way from rate and increment to angle) and `stamps`
(the rate that time stamps give), `encoder_readings` and `columns` (names and columns as channels,
and the table's angle), `model` (the recording). It knows no files and does not judge.
"""
