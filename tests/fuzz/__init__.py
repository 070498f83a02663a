"""Damaged and hostile files, many of them; kept out of the default suite (``make test-fuzz``)."""
