"""Sequences of steps, read, written and planned for the page."""

from __future__ import annotations

from typing import Any

import httpx
import msgspec
import pytest

from bioscara import Frame, Joints, NamedPose, Pose, Robot, TeachTable, load_parameters
from bioscara.api import messages as m
from bioscara.robot.planner import Planner
from bioscara.robot.sequences.script import to_script
from bioscara.robot.sequences.sequence_file import sequence_of_text, text_of_sequence
from bioscara.robot.sequences.steps import StepSequence, sequence_of
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.workspace.workspace import Workspace
from robot.sequences.samples import EACH_KIND
from served import HALF
from web.gateways import Site, site

TO, FAR = [0.5, 0.1, 0.25, 0.3], [2.0, 0.1, 0.25, 0.3]


def sequence(*places: list[float], **more: object) -> dict[str, object]:
    steps = [{"kind": "move_linear", "pose": dict(zip(["x", "y", "z", "yaw"], place, strict=True))}
             for place in places]  # fmt: skip
    return {"steps": [*steps, {"kind": "wait", "seconds": 0.5}], **more}


def result_of(answer: httpx.Response) -> Any:
    """Return the result of a verdict."""
    assert (answer.status_code, answer.json()["failure"]) == (200, None)
    return answer.json()["result"]


def failure_of(answer: httpx.Response) -> Any:
    """Return why a verdict says that the content cannot be used."""
    assert (answer.status_code, answer.json()["result"]) == (200, None)
    return answer.json()["failure"]


def test_a_sequence_is_read_written_and_made_a_script(left: Site) -> None:
    values = sequence(TO, title="<b>&amp;")
    made: StepSequence = sequence_of(values)
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        text = result_of(client.post("/api/sequences/write", json=values))["text"]
        assert sequence_of_text(text, "file") == made
        read = client.post("/api/sequences/read?name=a.yaml", content=text)
        assert sequence_of(result_of(read)) == made
        script = result_of(client.post("/api/sequences/script", json=values))["text"]
        assert script == to_script(made)
        part = client.post("/api/sequences/script?first=1&last=2", json=values)
        assert result_of(part)["text"] == to_script(made, 1, 2)
        refused = client.post(
            "/api/sequences/read?name=a.yaml", content=text.replace("seconds: 0.5", "seconds: -1")
        )
        assert failure_of(refused)["text"].endswith("steps[1].seconds: -1 s is outside 0 .. 3600 s")
        refused = client.post("/api/sequences/read?name=a.yaml", content=b"\xff")
        assert failure_of(refused)["text"] == "a.yaml: not a text file: byte 0 is not UTF-8"
        assert client.post("/api/sequences/write", content="{").status_code == 422
        assert client.post("/api/sequences/write", content="[" * 10000).status_code == 422
    assert text == text_of_sequence(made)


def test_a_sequence_is_planned_from_where_the_arm_is() -> None:
    with site("fast", 50.0) as fast, fast.http(headers=fast.bearer(Scope.VIEW)) as client:
        refused = client.post("/api/sequences/plan", json=sequence(TO))
        assert failure_of(refused)["error"] == "NotHomedError"
        with Robot.connect("arm:fast") as robot:
            robot.home()
            robot.move_joints(HALF)
        planned = result_of(client.post("/api/sequences/plan", json=sequence(TO)))
        assert [each["label"] for each in planned["verdicts"]] == ["1 move_linear", "2 wait"]
        assert planned["verdicts"][1]["duration"] == 0.5
        assert planned["verdicts"][0]["task"]["kind"] == "move_linear"
        assert planned["verdicts"][1]["task"] == {"kind": "wait", "seconds": 0.5}
        assert planned["duration"] == pytest.approx(planned["verdicts"][0]["duration"] + 0.5)
        positions = client.get("/api/state").json()["positions"]
        assert planned["trajectory"]["positions"][0] == pytest.approx(positions, abs=1e-3)
        planned = result_of(client.post("/api/sequences/plan", json=sequence(TO, FAR)))
        assert planned["verdicts"][1]["duration"] is None
        assert planned["verdicts"][1]["failure"]["error"] == "UnreachableError"
        assert planned["verdicts"][1]["failure"]["text"].startswith("step 2: (2, 0.1, 0.25) m")
        last = result_of(client.post("/api/sequences/plan?first=2", json=sequence(TO, FAR)))
        assert [each["label"] for each in last["verdicts"]] == ["3 wait"]
        one = result_of(client.post("/api/sequences/plan?first=0&last=1", json=sequence(TO, FAR)))
        assert [each["label"] for each in one["verdicts"]] == ["1 move_linear"]


def test_the_task_of_each_step_is_one_that_an_owner_understands() -> None:
    space = Workspace.of(load_parameters())
    with_names = space.with_table(
        TeachTable(
            space.tool,
            (),
            (
                NamedPose("gate", Joints(0.0, 0.2, 1.2, -0.6)),
                NamedPose("between", None, Pose(0.55, 0.15, 0.2)),
                NamedPose("gate2", None, Pose(0.5, 0.1, 0.2, 0.6)),
            ),
            (Frame("bench", Pose(0.3, 0.0, 0.2)),),
        )
    )
    planner = Planner(with_names, lambda: HALF)
    tasks = [run.task(planner) for run in EACH_KIND.runs()]
    for task in tasks:
        sent = m.ClientRequest(id=1, command=m.Start(task=task))
        assert msgspec.json.decode(msgspec.json.encode(sent), type=m.FromClient) == sent
