"""Files of 1 MiB that no program wrote: each is refused or read, in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.errors import BioscaraError
from system.odd_files import READERS, SHAPES

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("name", READERS)
def test_a_file_of_any_shape_is_refused_or_read(name: str, tmp_path: Path) -> None:
    complaints, path = [], tmp_path / name
    for shape, content in SHAPES.items():
        path.write_bytes(content)
        told = ""
        try:
            READERS[name](path)
        except BioscaraError as error:
            told = str(error)
        except Exception as error:  # noqa: BLE001  that is the complaint
            complaints.append(f"{shape}: {type(error).__name__}: {str(error)[:100]}")
        if len(told) > 1000 + len(str(path)) or not told.isprintable():
            complaints.append(f"{shape}: {len(told)} characters: {told[:100]!r}")
    assert complaints == []
