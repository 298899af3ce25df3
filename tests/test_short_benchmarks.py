"""The benchmarks of served arms in a short form: far beyond their limits, they would be noticed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from entries import entry

pytestmark = [pytest.mark.thorough, pytest.mark.timeout(300)]

SHORT = {
    "BIOSCARA_STOPS": "6",
    "BIOSCARA_TURNS": "1",
    "BIOSCARA_SECONDS": "4",
    "BIOSCARA_VIEWERS": "4",
}
SLACK = 5.0
"""Part of a limit that may be used: a percentile of few, while other tests run."""
_ROOT = Path(__file__).parents[1]
_PROGRAM = """
import importlib, json, sys
rows = importlib.import_module(f"benchmarks.{sys.argv[1]}").rows()
print(json.dumps([(row.what, row.value, row.used) for row in rows]))
"""


@pytest.mark.parametrize("topic", ["server", "hostile"])
def test_no_row_is_far_beyond_its_limit(topic: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, topic],
        cwd=_ROOT,
        env={**os.environ, **SHORT, "PYTHONPATH": os.fspath(_ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-4000:]
    for what, value, used in json.loads(done.stdout):
        with entry(what):
            assert used < SLACK, f"{value}: {used:.2f} of the limit"
