"""How long a refusal is shown."""

from __future__ import annotations

from bioscara.ros.refusals import SHOWN, Refusals


def test_a_refusal_is_shown_for_a_while_or_until_a_request_is_accepted() -> None:
    time = 5.0
    refusals = Refusals(lambda: time)
    assert refusals.last == ""
    refusals.add("cannot switch")
    time += SHOWN - 0.1
    assert refusals.last == "cannot switch"
    refusals.add("cannot home")
    time += SHOWN - 0.1
    assert refusals.last == "cannot home"
    time += 0.2
    assert refusals.last == ""
    refusals.add("cannot switch")
    refusals.clear()
    assert refusals.last == ""
