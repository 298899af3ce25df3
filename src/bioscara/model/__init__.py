"""Model of the arm: its parameters as immutable values in SI units, its shapes and description.

``parameters.yaml`` holds the values of the existing arms, each with its unit and source;
``parameters`` defines them as classes with their limits, ``loading`` reads the file; ``validation``
is how values are checked, ``yaml_file`` gives those of a file,
``existing_arms`` has those of the existing arms, checked before. ``parts`` is the drawing of the
arm, made of ``solids``; planning's collision bodies follow from it. ``urdf`` is the description,
which ``tools/description.py`` generates; ``tags`` are the names used
in it.
"""

from bioscara.model.loading import (
    load_parameters as load_parameters,
    own_parameters as own_parameters,
)
from bioscara.model.parameters import (
    ArmParameters as ArmParameters,
    GeometryParameters as GeometryParameters,
    GripperParameters as GripperParameters,
    HomingParameters as HomingParameters,
    JointParameters as JointParameters,
    PwmOutput as PwmOutput,
)
