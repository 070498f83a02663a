"""What an analysis looks like outside: JSON, tables, figures and a page a person can read."""
