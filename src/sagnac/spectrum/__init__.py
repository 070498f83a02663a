"""Transforms, spectra and noise floors of long series."""
