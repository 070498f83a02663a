"""Whether a recording is sound: detectors, what each finding does to N, and its remedy.

`check` holds the list of detectors and walks it; `profile` is what they are given of a channel,
with the step of its readout (`lattice`) and its noise made white (`whitening`); `effects` words a
finding, what it does to N and its remedy; `samples`, `distribution`, `readout`, `encoder` and
`physics` are the detectors, by what they look at. It uses neither the room of spectra nor that of
fits.
"""
