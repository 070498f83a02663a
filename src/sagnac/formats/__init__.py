"""Recordings in files: path -> Recording, Recording -> path.

A module for each kind of file (`csv`, `arrow`, `matlab`, `npz`, `psins`, `hdf5`) opens one as a
`source.Source`: its columns, what it states about them, and how to load them. `registry` lists the
formats, and `read_write` picks one. `assemble` builds the recording from the source and from what
the caller (`Statement`) and a TOML beside the file state; they are heard in this order: caller,
TOML, file (`statement`).
"""

from sagnac.formats.read_write import accelerometers_in, columns, gyros_in, missing, read, write
from sagnac.formats.statement import Statement

__all__ = ["Statement", "accelerometers_in", "columns", "gyros_in", "missing", "read", "write"]
