"""What a forked child of this process has to forget: connections and devices of its parent."""

from __future__ import annotations

import os
from collections.abc import Callable
from weakref import WeakMethod

_forgetting: list[WeakMethod[Callable[[], object]]] = []


def in_child(method: Callable[[], object]) -> None:
    """Call a bound method in each child that this process forks, while its object exists.

    In the child no thread of the parent runs, and a lock may be held for ever: the method takes
    none. It closes descriptors without a word to the other end, which belongs to the parent.

    Args:
        method: The method, without arguments.
    """
    _forgetting[:] = [each for each in _forgetting if each() is not None]
    _forgetting.append(WeakMethod(method))


def _forget() -> None:
    for reference in _forgetting:
        if (method := reference()) is not None:
            method()
    # Of a child of the child, too, there is nothing to forget any more.
    _forgetting.clear()


os.register_at_fork(after_in_child=_forget)
