"""The parser of messages against a general YAML parser: accepted texts are read alike."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st
from ruamel.yaml import YAML

from bioscara.errors import TrajectoryError
from bioscara.planning.files.ros_message_parser import DEPTH_MAX, first_document

DATA = Path(__file__).parents[2] / "data"
FILES = tuple((DATA / name).read_text() for name in ("planned_pilz_ptp.yaml",))

keys = st.from_regex(r"[a-z_][a-z0-9_]{0,8}", fullmatch=True).filter(
    lambda key: key not in {"y", "n", "yes", "no", "on", "off", "true", "false", "null"}
)
words = st.one_of(
    st.floats(allow_nan=False).map(repr),
    st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=12),
)
nodes = st.recursive(
    words,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(keys, inner, min_size=2, max_size=4)
    ),
    max_leaves=20,
)


def _general(text: str) -> Any:
    """Return the result of a general reader, with every word as text and null as None."""
    yaml = YAML(typ="base", pure=True)
    return _blank_is_none(next(iter(yaml.load_all(text)), None))


def _blank_is_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _blank_is_none(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_blank_is_none(item) for item in value]
    return None if value == "" else value


@pytest.mark.parametrize("flow", [False, True])
@given(value=st.dictionaries(keys, nodes, min_size=1, max_size=4))
def test_messages_of_other_writers_are_read_alike(flow: bool, value: dict[str, Any]) -> None:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = flow
    yaml.width = 100_000
    stream = io.StringIO()
    yaml.dump(value, stream)
    try:
        found = first_document(stream.getvalue()).value
    except TrajectoryError:
        # Only words that a message does not hold are refused.
        odd = set("\\#:?") & set(stream.getvalue().replace(": ", ""))
        assert odd
        return
    assert _blank_is_none(found) == _general(stream.getvalue())


SNIPPETS = (
    "\n",
    " ",
    "  ",
    "- ",
    "-",
    ":",
    ": ",
    "[",
    "]",
    "{",
    "}",
    ",",
    "'",
    '"',
    "#",
    " #",
    "x",
)
SEEDS = (
    "a:\n- b: 1\n  c: [1, 2, {d: 3}]\n- e:\n  f: 'it''s'\ng: {h: [], i: {}}\n---\nz: 1\n",
    'a: [1,\n  2]\nb:\n  c:\n    - x\n    -\n    - - y\n      - z\nd: "w"  \n',
    *(text[180:900] for text in FILES),
)


@given(st.sampled_from(SEEDS), st.data())
def test_a_damaged_text_that_is_accepted_is_read_alike(seed: str, data: st.DataObject) -> None:
    text = seed
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.integers(0, 3))
        text = text[:at] + data.draw(st.sampled_from(("", *SNIPPETS))) + text[at + cut :]
    try:
        found = first_document(text).value
    except TrajectoryError:
        return
    assert _blank_is_none(found) == _general(text)


@pytest.mark.parametrize("text", FILES)
def test_a_real_message_is_read_alike(text: str) -> None:
    document = first_document(text)
    assert _blank_is_none(document.value) == _general(text)
    assert document.unfinished == ()
    assert not document.more


@pytest.mark.parametrize("mark", ["[", "{a: ", "- ", "- a:\n"])
def test_deep_nesting_is_refused(mark: str) -> None:
    with pytest.raises(TrajectoryError, match=f"line [0-9]+: .*more than {DEPTH_MAX} deep"):
        first_document(
            mark * 16_000
            if "\n" not in mark
            else "".join("  " * level + mark for level in range(100))
        )


def test_a_bracket_may_go_over_several_lines() -> None:
    assert first_document("a: [1, # one\n  2,\n]\n").value == {"a": ["1", "2"]}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: 1\n b: 2\n", "line 2: .*where 'name: value' should stand"),
        ("- a\n  - b\n", "line 2: .*indented too far"),
        ("a: 1\n- b\n", "line 2: .*where 'name: value' should stand"),
        ("a:\n\tb: 1\n", "line 2: .*tabs"),
        ("a: |\n  text\n", "line 1: .*not understood"),
        ("a: b: c\n", "line 1: .*not understood"),
        ("a: 'b' c\n", "line 1: .*one quoted word"),
        ("a: [1 2] 3\n", "line 1: .*'3' after the closing bracket"),
        ("a: {b}\n", "line 1: .*where 'name: value' should stand"),
        ("a: [b, {c: 1]\n", "line 1: .*where ',' or '}' should stand"),
        ("a: [1,\n\n", "bracket is not closed"),
        ("a: 'b # c'\n", "line of its own"),
        ("a: *b\n", "aliases and tags"),
    ],
)
def test_a_text_that_is_no_message_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(TrajectoryError, match=words):
        first_document(text)
