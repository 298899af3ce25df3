"""``bioscara disturb``: the world around a served arm, from a shell."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bioscara.server.serve import Served
from cli.said import Said
from physics.served_world import world_served
from programs import wait_until
from served import arm_served


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with world_served() as made:
        yield made


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Said:
    return Said(capsys)


def test_bodies_are_listed_pushed_tilted_added_and_removed(served: Served, said: Said) -> None:
    simulation = served.robot.simulation
    lines = [line.split() for line in said.output("disturb").splitlines()]
    assert lines[0][:2] == ["body", "kind"]
    assert ["plate", "labware", "0.3500", "0.2500", "0.0200"] in lines
    assert lines[-1] == ["held:", "nothing"]
    out = said.output("disturb push plate 0 0 3 --duration 0.2 --arm left")
    assert out == "plate is pushed for 0.2 s of the arm's time\n"
    wait_until(lambda: simulation.pose("plate").z > 0.03, "it jumps")
    assert said.output("disturb tilt b 0.002 --direction -1e-1") == "b is tilted by 2 mm\n"
    wait_until(lambda: simulation.pose("b").qy < -0.005, "it is tilted")
    assert "crate is in" in said.output("disturb obstacle crate -0.8 -0.8 0 -0.7 -0.7 0.1")
    assert simulation.pose("crate")[1:4] == pytest.approx((-0.75, -0.75, 0.05))
    assert said.output("disturb remove crate") == "crate is away\n"
    assert "crate" not in [body.name for body in simulation.bodies]


@pytest.mark.parametrize(
    ("words", "refusal"),
    [
        ("push plat 1 0 0", "there is no body 'plat' in the world; did you mean plate?"),
        ("push plate 1 0", "Z"),
        ("push plate 1 0 much", "'much' is not a number"),
        ("push plate 1 0 99", "force"),
        ("tilt plate 0.001", "plate moves freely"),
        ("remove", "NAME"),
        ("shove plate", "there is no"),
    ],
)
def test_what_is_not_possible_is_refused(
    words: str, refusal: str, served: Served, said: Said
) -> None:
    assert refusal in said.refusal(f"disturb {words}")


def test_an_arm_without_a_world_is_named(said: Said) -> None:
    with arm_served():
        assert "this arm has no simulated world" in said.refusal("disturb list")
