"""Routes of the page that are no messages of the owner, through the gateway."""

from __future__ import annotations

import os
import socket
import time
from pathlib import Path

import pytest

from bioscara.dashboard.model import meshes
from bioscara.dashboard.trajectories import SIZE_MAX
from bioscara.files.regular_file import MCAP_BEGIN
from bioscara.model.stl import read_stl
from bioscara.robot.tasks.scope import Scope
from bioscara.web.routes.dashboard import trajectories
from programs import wait_until
from recording.served_arm import recording
from served import runtime_folder
from web.gateways import LIMIT, Site, site

CSV = b"time,j1,j2,j3,j4\n0,0.1,0.2,0.8,-0.5\n1,0.2,0.2,0.8,-0.5\n"


def test_each_mesh_of_the_model_is_served(left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        model = client.get("/api/model").json()
        names = {visual["mesh"] for link in model["links"] for visual in link["visuals"]}
        assert names == set(meshes())
        answer = client.get("/api/meshes/link_1_printed.stl")
        assert answer.headers["content-type"] == "model/stl"
        assert answer.headers["content-encoding"] == "gzip"
        assert abs(read_stl(answer.content)).max() < 1.0
        plain = client.get(
            "/api/meshes/link_1_printed.stl", headers={"Accept-Encoding": "identity"}
        )
        assert "content-encoding" not in plain.headers
        assert plain.content == answer.content
        for name in ("../bioscara.urdf", "..%2fbioscara.urdf", "absent.stl"):
            assert client.get(f"/api/meshes/{name}").status_code == 404


def test_a_trajectory_is_checked_and_errors_of_the_reader_are_passed_on(left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        answer = client.post("/api/trajectories?name=a.csv&fit=0", content=CSV)
        assert answer.status_code == 200, answer.text
        assert answer.json()["result"]["points"] == 2
        assert answer.json()["result"]["trajectory"]["joint_names"] == ["j1", "j2", "j3", "j4"]
        refused = client.post("/api/trajectories?name=a.csv", content=CSV.replace(b"0.8", b"x"))
        # An answer, and no error of the request: browsers report those in their console.
        assert (refused.status_code, refused.json()["result"]) == (200, None)
        assert refused.json()["failure"]["error"] == "TrajectoryError"
        assert "line 2: 'x' is not a number" in refused.json()["failure"]["text"]
        refused = client.post("/api/trajectories?fit=maybe", content=CSV)
        assert (refused.status_code, refused.json()["error"]) == (422, "InvalidArgumentError")


def test_a_file_that_is_too_long_is_refused_before_it_has_come(left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        answer = client.post("/api/trajectories", content=b"x" * (SIZE_MAX + 1))
        # Its length is not announced: it is cut off while it arrives.
        parts = (b"x" * 2**20 for _ in range(SIZE_MAX // 2**20 + 1))
        unannounced = client.post("/api/trajectories", content=parts)
    for each in (answer, unannounced):
        assert each.status_code == 413
        assert "more than 8 MiB" in each.json()["text"]


def test_a_slow_file_is_cut_off_and_hinders_no_other_request(
    left: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trajectories, "_TIMEOUT", 0.5)
    name, _, port = left.host.rpartition(":")
    token = left.bearer(Scope.VIEW)["Authorization"]
    with socket.create_connection((name, int(port)), timeout=LIMIT) as connection:
        head = f"POST /api/trajectories HTTP/1.1\r\nHost: {left.host}\r\nAuthorization: {token}\r\n"
        connection.sendall(f"{head}Content-Length: 1000\r\n\r\nx".encode())
        begin = time.monotonic()
        with left.http(headers=left.bearer(Scope.VIEW)) as client:
            assert client.get("/api/state").status_code == 200
        assert b" 408 " in connection.makefile("rb").readline()
        assert time.monotonic() - begin < LIMIT


def test_few_files_arrive_at_once(left: Site) -> None:
    name, _, port = left.host.rpartition(":")
    arriving = left.gateway.app.state.arriving
    slow: list[socket.socket] = []

    def sent(scope: Scope, text: str) -> None:
        """Begin two uploads with a token, and require that no further one of it is taken."""
        token = left.bearer(scope)["Authorization"]
        head = f"POST /api/trajectories HTTP/1.1\r\nHost: {left.host}\r\nAuthorization: {token}\r\n"
        for _ in range(2):
            slow.append(socket.create_connection((name, int(port)), timeout=LIMIT))
            slow[-1].sendall(f"{head}Content-Length: 1000\r\n\r\nx".encode())
        wait_until(lambda: len(arriving) == len(slow), "the files are on their way")
        with left.http(headers=left.bearer(scope)) as client:
            answer = client.post("/api/trajectories", content=CSV)
        assert (answer.status_code, answer.json()["text"].startswith(text)) == (503, True)

    try:
        sent(Scope.VIEW, "2 uploads are on their way")
        # Not those of who may only look: an operator's come in all the same.
        with left.http(headers=left.bearer(Scope.OPERATE)) as client:
            assert client.post("/api/trajectories", content=CSV).status_code == 200
        sent(Scope.OPERATE, "4 uploads are on their way")
        with left.http(headers=left.bearer(Scope.ADMIN)) as client:
            assert client.post("/api/trajectories", content=CSV).status_code == 503
    finally:
        for connection in slow:
            connection.close()
    wait_until(lambda: not arriving, "they have ended")


def test_the_clearance_is_unknown_until_the_arm_is_homed() -> None:
    with site("fast", speed=50.0) as made, made.http(headers=made.bearer(Scope.VIEW)) as client:
        assert client.get("/api/clearance").json()["distance"] is None
        made.served.robot.home()  # type: ignore[union-attr]
        found = client.get("/api/clearance").json()
    assert found["distance"] > 0.0
    assert len(found["link_point"]) == len(found["other_point"]) == 3


def test_parameters_are_drafted_and_written_by_the_owner(tmp_path: Path) -> None:
    overlay = tmp_path / "own.yaml"
    overlay.write_text("# mine\n", encoding="utf-8")
    with site("own", overlay=overlay) as made, made.http(headers=made.bearer(Scope.VIEW)) as client:
        rows = {row["name"]: row for row in client.get("/api/parameters").json()["rows"]}
        assert rows["joints.j2.upper"]["unit"] == "m"
        refused = client.post("/api/parameters/check", json={"changes": {"joints.j2.upper": 9}})
        assert (refused.status_code, refused.json()["result"]) == (200, None)
        assert "joints.j2.upper: 9 is outside" in refused.json()["failure"]["text"]
        changed = {"changes": {"joints.j2.upper": 0.3}}
        draft = client.post("/api/parameters/check", json=changed).json()["result"]
        assert draft["diff"][0] == {
            "name": "joints.j2.upper",
            "before": rows["joints.j2.upper"]["value"],
            "after": 0.3,
            "unit": "m",
        }
        assert overlay.read_text(encoding="utf-8") == "# mine\n"
        with made.client(Scope.ADMIN) as admin:
            epoch = admin.request("acquire_lease", time_to_live=5.0)["lease"]["epoch"]
            given = {"overlay": draft["overlay"], "revision": draft["revision"]}
            assert admin.request("set_parameters", epoch, **given)["restart"]
        table = client.get("/api/parameters").json()
    assert table["restart"]
    sources = {row["name"]: row["source"] for row in table["rows"]}
    assert [name for name, source in sources.items() if source == "overlay"] == ["joints.j2.upper"]
    assert overlay.read_text(encoding="utf-8").startswith("# mine\n")


@pytest.mark.parametrize(
    "body", [b"", b"[]", b'{"changes": []}', b'{"other": {}}', b"\xff", b"[" * 9999]
)
def test_changes_that_cannot_be_used_are_refused(body: bytes, left: Site) -> None:
    with left.http(headers=left.bearer(Scope.VIEW)) as client:
        answer = client.post("/api/parameters/check", content=body)
    assert (answer.status_code, answer.json()["error"]) == (422, "InvalidArgumentError")


def test_recordings_are_listed_downloaded_and_sampled(tmp_path: Path) -> None:
    with runtime_folder(), site("left", speed=20.0, recordings=tmp_path) as made:
        with recording(tmp_path) as recorder:
            owner = made.served.owner  # type: ignore[union-attr]
            begin = owner.sample.cycle
            wait_until(lambda: owner.sample.cycle > begin + 200, "some cycles are recorded")
            with made.http(headers=made.bearer(Scope.VIEW)) as client:
                (entry,) = client.get("/api/recordings").json()
            assert (entry["complete"], entry["writing"]) == (False, True)
            (path,) = recorder.end()
        with made.http(headers=made.bearer(Scope.VIEW)) as client:
            (entry,) = client.get("/api/recordings").json()
            assert (entry["name"], entry["complete"], entry["writing"]) == (path.name, True, False)
            answer = client.get(f"/api/recordings/{path.name}")
            assert answer.content == path.read_bytes()
            assert path.name in answer.headers["content-disposition"]
            samples = client.get(f"/api/recordings/{path.name}/samples?count=50").json()["result"]
            assert 25 <= len(samples["times"]) <= 50
            refused = client.get(f"/api/recordings/{path.name}/samples?count=1")
            assert (refused.status_code, refused.json()["error"]) == (422, "InvalidArgumentError")
            for name in ("left.sock", "..%2fleft.sock", path.name.upper()):
                assert client.get(f"/api/recordings/{name}").status_code == 404


def test_no_link_no_pipe_and_no_other_file_is_a_recording_or_a_flight_record(
    tmp_path: Path,
) -> None:
    recordings = tmp_path / "recordings"
    recordings.mkdir()
    with runtime_folder(), site("left", recordings=recordings) as made:
        tokens, elsewhere = made.gateway.token_file, tmp_path / "elsewhere.mcap"
        elsewhere.write_bytes(MCAP_BEGIN)
        names = [f"left-20260101T00000{number}Z.mcap" for number in range(6)]
        for folder in (recordings, made.evidence):
            (folder / names[0]).symlink_to(elsewhere)
            os.mkfifo(folder / names[1])
            (folder / names[2]).mkdir()
            (folder / names[3]).hardlink_to(tokens)
            (folder / names[4]).write_bytes(MCAP_BEGIN[:-1])
            (folder / names[5]).write_bytes(b"")
        with made.http(headers=made.bearer(Scope.VIEW)) as client:
            assert client.get("/api/recordings").json() == []
            assert client.get("/api/flight-records").json()["names"] == []
            secret = made.gateway.tokens.of(Scope.ADMIN)
            for name in names:
                assert client.get(f"/api/recordings/{name}").status_code == 404
                samples = client.get(f"/api/recordings/{name}/samples")
                assert samples.status_code == 404
                record = client.get(f"/api/flight-records/{name}")
                assert record.status_code == 404
                assert secret not in samples.text + record.text
            (recordings / names[5]).write_bytes(MCAP_BEGIN)
            (made.evidence / names[5]).write_bytes(MCAP_BEGIN)
            assert client.get(f"/api/recordings/{names[5]}").content == MCAP_BEGIN
            assert client.get(f"/api/flight-records/{names[5]}").content == MCAP_BEGIN
