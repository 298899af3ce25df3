"""The arm as data: a file goes in, frozen values in SI units come out.

``parameters.yaml`` holds the values of the existing arms, each with its unit and source;
``parameters`` is what they are to a program, ``loading`` reads and checks the file, with
``yaml_section`` and ``checks``. ``parts`` is the drawing of the arm, of which ``solids`` and
``meshes`` make its shapes and ``urdf`` its description; ``tags`` are words of that.
"""

from bioscara.model.loading import load_parameters as load_parameters
from bioscara.model.parameters import ArmParameters as ArmParameters
from bioscara.model.parameters import GeometryParameters as GeometryParameters
from bioscara.model.parameters import GripperParameters as GripperParameters
from bioscara.model.parameters import HomingParameters as HomingParameters
from bioscara.model.parameters import JointParameters as JointParameters
from bioscara.model.parameters import PwmOutput as PwmOutput
