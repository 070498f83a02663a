"""Whether a recording is sound: detectors, what each finding does to N, and its remedy.

`check` calls all of them. `profile` says how the noise runs through a channel, `effects` what a
finding does to N; `readout`, `distribution`, `gaps`, `encoder_faults`, `repeats`, `spikes` and
`physics` are the detectors, each with the faults that it sees. It knows no spectra and no fits.
"""
