"""The turning table: its turns, its motion, the Earth beneath it, and the frames on it."""
