"""An analysis as others see it: JSON, tables, figures and a page a person can read."""
