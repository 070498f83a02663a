"""One room per file format: path -> Recording, Recording -> path."""
