"""From a recording to its angle random walk."""
