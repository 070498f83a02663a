"""The paper's experiment: its numbers, and runs that set ours beside them."""
