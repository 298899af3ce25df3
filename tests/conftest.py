"""Settings of all property tests: judged by what they find, never by how fast the machine is."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("bioscara", deadline=None, print_blob=True)
settings.load_profile("bioscara")
