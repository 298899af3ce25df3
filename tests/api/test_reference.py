"""The reference of the messages is that of the messages, and its schema judges real ones."""

from __future__ import annotations

import json

from tools.api_reference import PAGE, SCHEMA, page, schema

from bioscara.api import framing, messages as m
from bioscara.kinematics import Pose
from bioscara.robot import tasks
from bioscara.sim.bench import FAULTS


def test_the_committed_reference_is_current() -> None:
    assert page() == PAGE.read_text()
    assert schema() == SCHEMA.read_text()


def test_every_field_of_every_message_is_described() -> None:
    undescribed = [
        line
        for line in PAGE.read_text().splitlines()
        if line.startswith("| `") and line.endswith("|  |")
    ]
    assert undescribed == []


def test_the_schema_has_every_kind_of_message() -> None:
    kinds = json.loads(SCHEMA.read_text())["$defs"]
    request = m.ClientRequest(
        id=1, command=m.Start(task=tasks.MoveTo(pose=Pose(0.4, 0.0, 0.2, 0.0)))
    )
    encoded = json.loads(framing.encode_json(request))
    assert set(encoded) == set(kinds["ClientRequest"]["properties"])
    assert set(encoded["command"]["task"]) == set(kinds["MoveTo"]["properties"])


def test_the_faults_of_the_messages_are_those_of_the_simulated_arm() -> None:
    assert set(m.SIMULATED_FAULTS) == set(FAULTS)
