"""Sequence files: the same after a file, whole or refused, with the line and the remedy."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given

from bioscara.errors import ConfigurationError, TrajectoryError
from bioscara.planning import read
from bioscara.robot.sequences.sequence_file import (
    is_sequence,
    read_sequence,
    sequence_of_text,
    text_of_sequence,
    write_sequence,
)
from bioscara.robot.sequences.steps import STEPS_MAX, StepSequence, sequence_of, values_of
from robot.sequences.samples import EACH_KIND, sequences

FILE = """\
schema: 1
title: plate
steps:
- {kind: move_named, name: above, velocity_scaling: 0.5}
- kind: move_linear
  pose: {x: 0.0, y: 0.05, z: 0.011, yaw: 0.0}
  velocity_scaling: 0.3
- {kind: move_gripper, width: 0.08}
- {kind: wait, seconds: 0.5}
...
"""


@given(sequences())
def test_a_sequence_is_the_same_after_a_file(sequence: StepSequence) -> None:
    assert sequence_of_text(text_of_sequence(sequence), "file") == sequence


@given(sequences())
def test_a_sequence_is_the_same_after_plain_values(sequence: StepSequence) -> None:
    assert sequence_of(values_of(sequence)) == sequence


def test_a_file_is_written_whole_and_recognised(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    assert not is_sequence(path)
    write_sequence(path, EACH_KIND)
    assert is_sequence(path)
    assert read_sequence(path) == read_sequence(str(path)) == EACH_KIND
    with pytest.raises(TrajectoryError, match="carry it out with 'bioscara run"):
        read(path)
    with pytest.raises(ConfigurationError, match="cannot be saved"):
        write_sequence(tmp_path / "none" / "a.yaml", EACH_KIND)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            "velocity_scaling: 0.3",
            "velocity_scaling: 3",
            "line 7: steps[1].velocity_scaling: 3.0 is outside 0.001 .. 1; it is a",
        ),
        (
            "velocity_scaling: 0.3",
            "speed: 0.3",
            "line 7: steps[1].speed is called velocity_scaling now",
        ),
        (
            "kind: move_gripper",
            "kind: gripper_move",
            "steps[2]: the kind gripper_move is called move_gripper now",
        ),
        (
            "width:",
            "widht:",
            "line 8: steps[2].widht is not a known parameter; did you mean width?",
        ),
        (
            "kind: wait",
            "kind: wiat",
            "line 9: steps[3]: there is no kind 'wiat'; did you mean wait?",
        ),
        ("kind: wait, ", "", "line 9: steps[3]: it needs a kind; there are move_joints,"),
        (
            "velocity_scaling: 0.3",
            "blend: 0.1",
            "line 7: steps[1].blend: 0.1 m, but the next step is no line",
        ),
        (
            "velocity_scaling: 0.3",
            "blend: 1e-9",
            "blend: 1e-09 m is below 0.0001 m; 0 rests",
        ),
        ("velocity_scaling: 0.3", "name: plate", "steps[1].name is called pose now"),
        ("name: above", "name: 2", "line 4: steps[0].name is 2; give a text"),
        (
            "x: 0.0",
            "x: 50",
            "line 6: steps[1].pose.x: 50 m is outside -10 .. 10 m; are these",
        ),
        ("x: 0.0", "x: .nan", "steps[1].pose.x is nan, which is not a finite number"),
        ("...\n", "", "line 10: the file is truncated: it does not end with a line '...'"),
        ("schema: 1", "schema: 2", "schema: 2 cannot be read; this version of bioscara reads 1"),
        ("schema: 1\n", "", "line 1: schema is missing; begin with 'schema: 1'"),
        ("title: plate", 'title: "a\\nb"', "title: it must be one printable line"),
    ],
)
def test_a_file_is_refused_with_its_line(old: str, new: str, text: str) -> None:
    assert FILE.count(old) == 1
    with pytest.raises(ConfigurationError) as caught:
        sequence_of_text(FILE.replace(old, new), "a.yaml")
    assert str(caught.value).startswith("a.yaml, line ")
    assert text in str(caught.value)


def test_no_and_too_many_steps_are_refused() -> None:
    step = {"kind": "open_gripper"}
    assert len(sequence_of({"steps": [step] * STEPS_MAX}).steps) == STEPS_MAX
    with pytest.raises(ConfigurationError, match="201 steps, at most 200"):
        sequence_of({"steps": [step] * (STEPS_MAX + 1)})
    with pytest.raises(ConfigurationError, match="a sequence has at least one step"):
        sequence_of({"steps": []})


def test_a_refused_value_of_a_browser_has_the_number_of_the_step() -> None:
    with pytest.raises(ConfigurationError, match=r"^step 2 seconds: -1 s is outside 0 .. 3600 s$"):
        sequence_of({"steps": [{"kind": "open_gripper"}, {"kind": "wait", "seconds": -1}]})
    with pytest.raises(ConfigurationError, match=r"^schema 7 cannot be read"):
        sequence_of({"schema": 7, "steps": []})
