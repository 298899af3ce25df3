"""``bioscara view`` from a terminal."""

from __future__ import annotations

import importlib.util
import os
import re
import signal
import subprocess
import sys
import urllib.request

import pytest

from bioscara.cli import main


def test_without_viser_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    monkeypatch.delitem(sys.modules, "bioscara.viewer.page", raising=False)
    assert main(["view"]) == 2
    error = capsys.readouterr().err
    assert "pip install 'bioscara[view]'" in error
    assert len(error.splitlines()) == 1


@pytest.mark.skipif(importlib.util.find_spec("viser") is None, reason="needs bioscara[view]")
def test_it_serves_until_it_is_interrupted() -> None:
    view = subprocess.Popen(
        [sys.executable, "-m", "bioscara", "view", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        assert view.stdout is not None
        for line in view.stdout:
            found = re.search(r"the arm in 3D: (http://127\.0\.0\.1:\d+)", line)
            if found:
                break
        else:
            pytest.fail("it said no address")
        with urllib.request.urlopen(found[1]) as answer:
            assert answer.status == 200
        view.send_signal(signal.SIGINT)
        assert view.wait(timeout=20) == 0
    finally:
        view.kill()
        view.wait()
        view.stdout.close()


@pytest.mark.parametrize("port", ["-1", "65536", "http"])
def test_a_wrong_port_is_refused(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["view", "--port", port])
    assert "is not a port" in capsys.readouterr().err
