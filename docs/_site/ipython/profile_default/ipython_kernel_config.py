"""The kernel of the pages: it listens to this machine alone, and says nothing of that."""

c = get_config()  # noqa: F821
c.IPKernelApp.log_level = 40
