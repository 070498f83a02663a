"""What tests of several formats ask for."""

import pytest


@pytest.fixture
def trusted_hdf5(monkeypatch):
    """A sound file is opened without the process that tries it first, which has to start."""
    monkeypatch.setattr("sagnac.formats.hdf5.require_survivable", lambda path: None)
