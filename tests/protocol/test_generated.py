"""Files generated from the register table match the present table."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.protocol.generate import OUTPUTS, main

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", OUTPUTS)
def test_generated_files_are_fresh(name: str) -> None:
    assert (ROOT / name).read_text() == OUTPUTS[name](), "run make generate"


def test_a_stale_file_is_reported_and_then_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in OUTPUTS:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    assert main([str(tmp_path), "--check"]) == 1
    assert "registers.h is stale" in capsys.readouterr().err
    assert main([str(tmp_path)]) == 0
    assert main([str(tmp_path), "--check"]) == 0
    header = tmp_path / "firmware/joint/src/generated/registers.h"
    header.write_text(header.read_text().replace("0x2D", "0x2C"))
    assert main([str(tmp_path), "--check"]) == 1
