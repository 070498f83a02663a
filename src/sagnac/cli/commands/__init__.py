"""One module a command; what takes time to import is imported when the command runs."""
