"""The committed parameters as a generated module: the same values as those of the file."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tools import existing_arms as generator

from bioscara.errors import ConfigurationError
from bioscara.model import existing_arms, load_parameters, loading
from bioscara.model.loading import EXISTING_ARMS


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the committed file, in its stead."""
    copy = tmp_path / EXISTING_ARMS.name
    shutil.copy(EXISTING_ARMS, copy)
    monkeypatch.setattr(loading, "EXISTING_ARMS", copy)
    monkeypatch.setattr(generator, "EXISTING_ARMS", copy)
    return copy


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))


def test_the_module_has_the_values_of_the_file() -> None:
    checked = load_parameters(EXISTING_ARMS)
    assert existing_arms.parameters() == checked
    # Equal values may differ in type, as 1 and 1.0.
    assert repr(existing_arms.parameters()) == repr(checked)


def test_a_file_that_was_changed_is_read_and_checked(file: Path) -> None:
    change(file, "upper: 3.04647", "upper: 3.0")
    assert load_parameters().joints[0].upper == 3.0
    change(file, "upper: 3.0", "upper: 300.0")
    with pytest.raises(ConfigurationError, match=r"^parameters.yaml, line \d+: joints.j1.upper: "):
        load_parameters()


def test_a_file_that_is_missing_is_an_error(file: Path) -> None:
    file.unlink()
    with pytest.raises(ConfigurationError, match=r"^parameters.yaml: No such file"):
        load_parameters()


def test_a_stale_module_is_reported_and_then_written(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module = tmp_path / "existing_arms.py"
    shutil.copy(existing_arms.__file__, module)
    monkeypatch.setattr(existing_arms, "__file__", str(module))
    assert generator.main(["--check"]) == 0
    change(file, "upper: 3.04647", "upper: 3.0")
    assert generator.main(["--check"]) == 1
    assert "existing_arms.py: stale; run make generate" in capsys.readouterr().err
    assert generator.main([]) == 0
    assert generator.main(["--check"]) == 0
    assert "upper=3.0,\n" in module.read_text()
    change(file, "upper: 3.0", "upper: wrong")
    assert generator.main([]) == 2
    assert "joints.j1.upper: 'wrong' is not a number" in capsys.readouterr().err
