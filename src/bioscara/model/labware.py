"""The labware table: sizes, masses and grips of plates, lids, racks and reservoirs.

One table feeds the planner's shapes, the grip of the jaws and the bodies of simulated worlds. Files
of other labware have the same form as ``labware.yaml``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

from bioscara.errors import ConfigurationError
from bioscara.model.validation import Checked, Name, Problem, Restricted, Within, outside
from bioscara.model.yaml_file import YamlFile

LABWARE = Path(__file__).with_name("labware.yaml")
"""The labware that comes with the package."""
VERSION = 1
"""Version of the format that is read."""
SIZES = (1e-3, 0.5)
"""Smallest and largest size of labware [m]: a larger one is taken for millimetres."""
MASSES = (1e-3, 3.0)
"""Smallest and largest mass of labware [kg]: the arm carries no more, and a body without a mass
cannot be simulated."""
_MOST = 200
"""Most entries of a file."""
Size = Annotated[float, Within(*SIZES, "m")]
Mass = Annotated[float, Within(*MASSES, "kg")]


class Labware(Checked):
    """A kind of labware; its origin is the centre of its bottom.

    Attributes:
        name: The kind in world files: letters, digits and ``_``; begins with a letter.
        title: Its description.
        size: Along its long side, across it and upwards [m].
        mass: Of an empty one [kg].
        mass_assumed: Whether the mass is an assumption, since no source gives it.
        grip_width: Distance of the jaws that hold it across y [m].
        grip_height: Height of the tool centre point above its bottom when the jaws hold it [m].
        rim: Height of the raised edge at its top, which centres labware on it [m]; 0 for none.
        stackable: Whether labware may stand on it.
        source: Where the dimensions come from.
    """

    name: Annotated[str, Restricted(pattern="[A-Za-z][A-Za-z0-9_]{0,59}")]
    title: Name
    size: tuple[Size, Size, Size]
    mass: Mass
    mass_assumed: bool
    grip_width: Size
    grip_height: Size
    rim: Annotated[float, Within(0.0, 0.02, "m")]
    stackable: bool
    source: Name

    @property
    def stack_height(self) -> float:
        """Height above its bottom at which labware on top of it stands [m]."""
        return self.size[2] - self.rim

    def problems(self) -> Iterator[Problem]:
        """Yield heights above the top and a width that the labware does not have."""
        size = (("size",),)
        yield from outside(self.grip_height, 0.0, self.size[2], "m", "grip_height", others=size)
        yield from outside(self.grip_width, 0.0, self.size[1], "m", "grip_width", others=size)
        yield from outside(self.rim, 0.0, self.size[2] / 2.0, "m", "rim", others=size)


class _Table(Checked):
    """A labware file."""

    version: Annotated[int, Within(1, 10**6)]
    labware: tuple[Labware, ...]

    def problems(self) -> Iterator[Problem]:
        """Yield names that are there twice, and that there are too many."""
        names = [each.name for each in self.labware]
        if len(names) > _MOST:
            text = f"{len(names)} kinds; at most {_MOST} are read: split the file"
            yield Problem(text, ("labware",))
            return
        for index, name in enumerate(names):
            if name in names[:index]:
                yield Problem(f"{name} is there twice", ("labware", index, "name"))


def labware_table(*own: Path | str) -> Mapping[str, Labware]:
    """Return the known labware by name.

    Args:
        own: Files with other labware.

    Raises:
        ConfigurationError: A file cannot be read, a value is missing or cannot be used, or a name
            is that of other labware; the message names file and line.
    """
    table: dict[str, Labware] = {}
    for path in (LABWARE, *own):
        # The name alone for the committed file: its folder says nothing to a user.
        file = YamlFile.load(Path(path), path.name if path is LABWARE else str(path))
        file.check_version("version", VERSION)
        for index, kind in enumerate(_Table.checked(file.values, file.place).labware):
            if kind.name in table:
                raise ConfigurationError(
                    f"{file.place(('labware', index, 'name'))}labware {kind.name} is known already "
                    "from another file; give yours another name"
                )
            table[kind.name] = kind
    return MappingProxyType(table)
