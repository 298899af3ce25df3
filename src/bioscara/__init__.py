"""Bioscara: the software of a four-axis SCARA lab arm, from the wire to ROS 2.

Begin with ``Robot``: ``from bioscara import Robot, Pose``. The names of programs that move the arm
are here; each is imported when it is first used, so that ``import bioscara`` stays fast.
"""

from __future__ import annotations

from bioscara.version import __version__ as __version__

with open(f"{__file__}i", encoding="utf-8") as _stub:
    # Each line is "from MODULE import NAME as NAME": the names are declared there alone.
    _HOMES = {line.split()[3]: line.split()[1] for line in _stub if line.startswith("from ")}

__all__ = sorted(_HOMES)  # noqa: PLE0605  the stub has them


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415  slower than this module

    value = globals()[name] = getattr(import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
