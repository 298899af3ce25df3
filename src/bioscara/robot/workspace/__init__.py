"""Named tools and poses of one arm, and the file that keeps them.

Begin with ``poses``: a ``TeachTable`` holds named poses and ``tools``. ``teach_file`` loads and
saves a table as YAML.
"""

from bioscara.robot.workspace.poses import NamedPose as NamedPose
from bioscara.robot.workspace.poses import TeachTable as TeachTable
from bioscara.robot.workspace.teach_file import load_table as load_table
from bioscara.robot.workspace.teach_file import save_table as save_table
from bioscara.robot.workspace.tools import Tool as Tool
