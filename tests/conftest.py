"""Settings of all property tests: judged by their findings, never by the machine's speed."""

from __future__ import annotations

import signal

from hypothesis import settings

settings.register_profile("bioscara", deadline=None, print_blob=True)
settings.load_profile("bioscara")

# A run in the background of a shell ignores Ctrl-C, and so would each program that a test starts.
signal.signal(signal.SIGINT, signal.default_int_handler)
