"""Worlds: table, walls, nests and labware around an arm, and the files that describe them.

The planner avoids them as zones; a simulation gives them weight and friction.
"""

from bioscara.planning.world.bodies import (
    Grip as Grip,
    Item as Item,
    Nest as Nest,
    Table as Table,
    Wall as Wall,
)
from bioscara.planning.world.world import World as World
from bioscara.planning.world.world_file import read_world as read_world
