"""Without pinocchio, which has no wheels for some machines, there is no judge."""

from __future__ import annotations

from importlib.util import find_spec

collect_ignore_glob = [] if find_spec("coal") else ["*.py"]
