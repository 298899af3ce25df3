"""Files of a run: samples, report and plots, in a separate folder.

The input is the cycles of the control loop; the output is ``samples.csv``, ``report.txt``,
``plot.html`` and, if matplotlib is installed, ``plot.png``. Nothing here uses a bus, a joint or a
clock, and nothing here may stop a motion: files that cannot be written are reported at the end.

``cycles`` holds the values, ``sample_file`` writes them as CSV, ``samples`` returns them as arrays,
``statistics`` condenses them, and ``summary`` has the facts that the samples do not contain;
``text``, ``html`` and ``png`` present all of it, and ``folder`` is the folder of a run.
``plan_png`` and ``plan_views`` draw plans.
"""

from bioscara.report.cycles import (
    CycleHistory as CycleHistory,
    CycleRecord as CycleRecord,
    JointRecord as JointRecord,
    Phase as Phase,
    SampleQuality as SampleQuality,
)
from bioscara.report.folder import RunFolder as RunFolder
from bioscara.report.summary import (
    JointInfo as JointInfo,
    Outcome as Outcome,
    RunSummary as RunSummary,
)
