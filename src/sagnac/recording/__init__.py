"""A recording: channels, what one sample of them is, when they were read, and the table's angle.

Low to high: `channel` (one column in SI, and the way from rate and increment to angle),
`encoder_readings` (the table's angle), `columns` (names and columns as channels) and `stamps`
(the rate that time stamps give), `model` (the recording). It knows no files and does not judge.
"""
