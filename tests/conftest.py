"""What holds for every test, before numpy is imported."""

import os

# Thousands of small factorizations: several threads only wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")
