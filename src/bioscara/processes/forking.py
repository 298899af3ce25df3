"""Forked children: resources that they have to release, and calls that belong to their parent."""

from __future__ import annotations

import os
from collections.abc import Callable
from weakref import WeakMethod

from bioscara.errors import NotInitializedError

_forgetting: list[WeakMethod[Callable[[], object]]] = []


class Maker:
    """The process in which an object was made, to which it belongs.

    Args:
        what: The object, as the subject of a sentence.
        remedy: The alternative for a forked child.
    """

    def __init__(self, what: str, remedy: str) -> None:
        self._what, self._remedy = what, remedy
        self._process = os.getpid()

    @property
    def left(self) -> bool:
        """Whether this process is another one, forked from that."""
        return os.getpid() != self._process

    def require(self) -> None:
        """Raise in a forked child.

        Raises:
            NotInitializedError: This is one.
        """
        if self.left:
            raise NotInitializedError(
                f"{self._what} belongs to process {self._process}, from which this one was forked; "
                f"{self._remedy}"
            )


def in_child(method: Callable[[], object]) -> None:
    """Call a bound method in each child that this process forks, while its object exists.

    In the child no thread of the parent runs, and a lock may never be released: the method takes
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
