"""What the site adds to Sphinx: `extension` alone needs Sphinx, the rest is read by tests, too."""
