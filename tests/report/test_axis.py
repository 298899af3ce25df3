"""Labels of the axes of plot.html, by the script that is part of it."""

from __future__ import annotations

import json
import shutil
import subprocess
from importlib.resources import files

import pytest

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="needs node, to run the script of the page")
MULTIPLES = (1.0, 2.0, 2.5, 5.0)
"""Steps between ticks that uPlot chooses, within a decade."""


def evaluate(expression: str) -> object:
    script = files("bioscara.report").joinpath("axis.js").read_text("utf-8")
    program = f"{script}\nconsole.log(JSON.stringify({expression}))"
    assert NODE is not None
    done = subprocess.run([NODE, "-e", program], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_labels_differ_are_exact_and_have_no_rounding_errors() -> None:
    cases = [
        (base, multiple * 10.0**exponent)
        for exponent in range(-9, 4)
        for multiple in MULTIPLES
        for base in (0.0, -3.0, 0.3)
    ]
    ticks = [[base + index * step for index in range(-3, 6)] for base, step in cases]
    steps = [step for _, step in cases]
    shown = evaluate(f"{json.dumps(ticks)}.map((t, i) => tickLabels(t, {json.dumps(steps)}[i]))")
    assert isinstance(shown, list)
    for (base, step), row, labels in zip(cases, ticks, shown, strict=True):
        aligned = base == 0.0 or step < 0.2
        assert len(set(labels)) == len(labels) or not aligned, (base, step, labels)
        for tick, label in zip(row, labels, strict=True):
            assert label != "-0"
            assert len(label) <= 14
            if aligned:
                assert float(label) == pytest.approx(tick, abs=1e-3 * step)


def test_a_label_has_no_more_decimals_than_its_step() -> None:
    assert evaluate("tickLabels([0.1 + 0.2, 0.4, null], 0.1)") == ["0.3", "0.4", ""]
    assert evaluate("tickLabels([-1e-17, 0.25], 0.25)") == ["0.00", "0.25"]
    assert evaluate("tickLabels([-5, 0, 5], 5)") == ["-5", "0", "5"]


def test_a_value_has_the_decimals_of_the_visible_range_up_to_those_of_the_data() -> None:
    assert evaluate("valueLabel(0.123456789, 0, 1)") == "0.123"
    assert evaluate("valueLabel(1.0228923, 1.022892, 1.022893, ' s')") == "1.022892 s"
    assert evaluate("valueLabel(null, 0, 1, ' s')") == "-"
    assert evaluate("valueLabel(0, -1e-9, 1e-9)") == "0"
