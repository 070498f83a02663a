"""What holds for every test, before numpy is imported."""

import os
import signal

# Thousands of small factorizations: several threads only wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")
# A shell that starts the tests in the background has them ignore SIGINT, and what they start, too.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
