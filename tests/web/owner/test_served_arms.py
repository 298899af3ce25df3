"""The arms of this computer through one gateway: how they are, and STOP."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from subprocess import Popen

import pytest

from bioscara.api import runtime
from bioscara.api.gateway_pages import Announcement, page_of
from bioscara.api.runtime import folder
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.guard import REQUESTS
from programs import wait_until
from served import runtime_folder
from web.gateways import Site, arm, site


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A gateway of one arm, and another arm without one."""
    evidence = tmp_path_factory.mktemp("right")
    with runtime_folder(), arm("right", evidence), site("left") as made:
        yield made


def test_each_arm_has_its_state_and_the_page_of_its_gateway(cell: Site) -> None:
    with cell.http(headers=cell.bearer(Scope.VIEW)) as client:
        left, right = client.get("/api/arms").json()
    assert (left["name"], left["page"], left["here"]) == ("left", cell.gateway.url, True)
    assert (right["name"], right["page"], right["here"]) == ("right", None, False)
    assert left["simulated"]
    assert right["simulated"]
    assert len(right["state"]["positions"]) == 4


@pytest.mark.parametrize("path", ["/api/arms/left/stop", "/api/arms/stop"])
def test_stop_of_another_arm_says_who_stopped_it(cell: Site, path: str) -> None:
    with cell.http(headers=cell.bearer(Scope.VIEW)) as client:
        found = client.post(path).json()
    assert {each["name"] for each in found} == ({"left"} if "left" in path else {"left", "right"})
    assert all(each["stopped"] for each in found)
    assert cell.served is not None
    events = cell.served.owner.events
    texts = [event.text for event in map(events.after, range(events.last)) if event]
    assert "stop (view, 127.0.0.1) stopped all motion" in texts


@pytest.mark.parametrize("name", ["absent", "%3Cb%3E", "a%0Ab", "a" * 500])
def test_a_name_that_is_none_stops_nothing(cell: Site, name: str) -> None:
    with cell.http(headers=cell.bearer(Scope.OPERATE)) as client:
        answer = client.post(f"/api/arms/{name}/stop")
    assert answer.status_code == 404


def test_stops_of_an_arm_that_is_none_use_up_no_stop_of_another_viewer(
    cell: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    lookups: list[float] = []
    owners = runtime.owners

    def counted() -> list[runtime.OwnerEntry]:
        lookups.append(time.monotonic())
        return owners()

    monkeypatch.setattr(runtime, "owners", counted)

    def post(path: str) -> set[int]:
        with cell.http(headers=cell.bearer(Scope.VIEW)) as client:
            return {client.post(path).status_code for _ in range(2 * REQUESTS)}

    paths = [*(f"/api/arms/absent{number}/stop" for number in range(4))]
    paths += ["/api/arms/left/stop", "/api/stop"]
    begin = time.monotonic()
    with ThreadPoolExecutor(len(paths)) as pool:
        found = list(pool.map(post, paths))
    assert found == [{404}, {404}, {404}, {404}, {200}, {200}]
    # At most 20 a second.
    assert len(lookups) <= 1 + 20 * (time.monotonic() - begin), len(lookups)


OWNER = """
import sys, threading
from pathlib import Path
from web.gateways import arm
with arm("silent", Path(sys.argv[1])):
    print("served", flush=True)
    threading.Event().wait()
"""


def test_an_owner_that_hangs_is_unknown_and_its_stop_is_not_confirmed(
    start: Callable[..., Popen[str]], tmp_path: Path
) -> None:
    with runtime_folder(), site("left") as made:
        program = tmp_path / "owner.py"
        program.write_text(OWNER)
        owner = start(str(program), str(tmp_path), env={**os.environ, "PYTHONPATH": "src:tests"})
        assert owner.stdout is not None
        assert owner.stdout.readline() == "served\n"
        os.kill(owner.pid, signal.SIGSTOP)
        try:
            with made.http(headers=made.bearer(Scope.VIEW)) as client:
                left, silent = client.get("/api/arms").json()
                assert left["state"] is not None
                assert (silent["state"], silent["simulated"]) == (None, None)
                assert f"process {owner.pid}, does not answer" in silent["text"]
                done = {each["name"]: each for each in client.post("/api/arms/stop").json()}
                assert done["left"]["stopped"]
                assert not done["silent"]["stopped"]
                assert "use the emergency stop" in done["silent"]["text"]
        finally:
            os.kill(owner.pid, signal.SIGCONT)
        owner.kill()
        owner.wait()
        with made.http(headers=made.bearer(Scope.VIEW)) as client:
            wait_until(lambda: len(client.get("/api/arms").json()) == 1, "it is forgotten")


def test_an_address_is_announced_while_its_gateway_lives() -> None:
    with runtime_folder():
        assert page_of("left") is None
        folder().mkdir(exist_ok=True)
        first = Announcement("left", 8080, "http://127.0.0.1:8080/")
        second = Announcement("left", 8081, "http://127.0.0.1:8081/")
        assert page_of("left") == "http://127.0.0.1:8080/"
        first.close()
        first.close()
        assert page_of("left") == "http://127.0.0.1:8081/"
        second.close()
        assert page_of("left") is None


@pytest.mark.parametrize("url", ["javascript:alert(1)", "http://a/b/", "http://a/\n", 7])
def test_an_address_that_is_none_is_not_believed(url: object) -> None:
    with runtime_folder():
        folder().mkdir(exist_ok=True)
        announced = Announcement("left", 1, url)  # type: ignore[arg-type]
        assert page_of("left") is None
        announced.close()


def test_what_a_killed_gateway_left_is_removed_later() -> None:
    with runtime_folder():
        path = folder() / "left.8080.page"
        path.write_text('{"url": "http://127.0.0.1:8080/"}')
        assert page_of("left") is None
        assert path.exists()
        os.utime(path, (0.0, 0.0))
        assert page_of("left") is None
        assert not path.exists()
