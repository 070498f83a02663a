"""The Allan family of stability curves, with degrees of freedom and intervals."""
