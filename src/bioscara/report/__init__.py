"""What is left of a run: samples, report, plots, in a folder of its own.

Cycles of the motion loop go in; ``samples.csv``, ``report.txt``, ``plot.html`` and, where
matplotlib is installed, ``plot.png`` come out. Nothing here touches a bus, a joint or a clock,
and nothing here may stop a motion: what cannot be written is told at the end.

``cycles`` holds the values, ``samples`` writes them as CSV, ``statistics`` condenses them,
``summary`` has the facts that they do not; ``text``, ``html`` and ``png`` show all of it, and
``folder`` is where it is kept. ``plan_png`` and ``plan_views`` draw what is only planned.
"""

from bioscara.report.cycles import CycleRecord as CycleRecord
from bioscara.report.cycles import History as History
from bioscara.report.cycles import JointRecord as JointRecord
from bioscara.report.cycles import Phase as Phase
from bioscara.report.cycles import Quality as Quality
from bioscara.report.folder import RunFolder as RunFolder
from bioscara.report.summary import JointInfo as JointInfo
from bioscara.report.summary import Outcome as Outcome
from bioscara.report.summary import Summary as Summary
