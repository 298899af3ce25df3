"""A robot description is read, or one clear error names the line."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from bioscara.errors import ConfigurationError
from bioscara.hardware.urdf import SIZE_MAX, Urdf
from bioscara.hardware.urdf_joints import tree_of
from bioscara.model.urdf import URDF

TEXT = URDF.read_text()


WRONG = [
    ('<robot name="bioscara">', '<robot name="bioscara"><oops>', "not XML"),
    ('<?xml version="1.0"?>', "<!DOCTYPE robot>", "no document type"),
    ('<?xml version="1.0"?>', '<!DOCTYPE robot [<!ENTITY a "b">]>', "no document type"),
]


@pytest.mark.parametrize(("old", "new", "complaint"), WRONG)
def test_xml_of_another_kind_is_refused_with_its_line(old: str, new: str, complaint: str) -> None:
    assert old in TEXT
    with pytest.raises(ConfigurationError, match=rf"arm\.urdf, line \d+: .*{complaint}"):
        Urdf(TEXT.replace(old, new, 1), "arm.urdf")


def test_files_that_are_no_urdf_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    with pytest.raises(ConfigurationError, match="No such file"):
        Urdf.load(file)
    for content, complaint in (
        (b"\xff\xfe", "not a text file"),
        (b"", "not XML"),
        (b"<sdf/>", "is not <robot>"),
        (b" " * (SIZE_MAX + 1), "at most"),
    ):
        file.write_bytes(content)
        with pytest.raises(ConfigurationError, match=complaint):
            Urdf.load(file)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_a_damaged_file_is_refused_or_reads_as_a_robot(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(TEXT) - 1))
    size = data.draw(st.integers(0, 20))
    text = TEXT[:at] + data.draw(st.text(max_size=4)) + TEXT[at + size :]
    with suppress(ConfigurationError):
        Urdf(text, "arm.urdf")


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            '<link name="base_link">',
            '<link name="lonely"/><link name="base_link">',
            "2 links have no",
        ),
        ('type="prismatic"', 'type="planar"', "type 'planar' is not one of"),
        (
            '<parent link="world"/>',
            '<parent link="link_1"/>',
            "joint base_joint has no parent in the tree",
        ),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 1"/>', "'0 1' are not three numbers"),
    ],
)
def test_a_description_that_is_not_a_tree_is_refused(old: str, new: str, complaint: str) -> None:
    assert old in TEXT
    with pytest.raises(ConfigurationError, match=complaint):
        tree_of(Urdf(TEXT.replace(old, new, 1), "arm.urdf"))
