"""An owner of the arm in a child process, for a node that is started with a bus."""

from __future__ import annotations

import subprocess
from types import TracebackType
from typing import Self

from bioscara.api import runtime
from bioscara.errors import BusyOwnerError, HardwareError, OwnerLostError
from bioscara.processes.child_process import child_command

_PATIENCE = 8.0
"""Time in which it has to end [s]: launch kills the node after 10 s."""


class OwnerProcess:
    """``bioscara serve`` in a child process, from entering to leaving.

    It ends with this process, however that ends. Entered in the main thread.

    Args:
        bus: Name of the bus.
        name: Name of the arm.
        rate: Control cycles per second [Hz]; None for the rate that suits the joints.
        homed: Whether the simulated joints are homed at the start.
    """

    def __init__(self, bus: str, name: str, rate: int | None, *, homed: bool = False) -> None:
        self._words = ["serve", "--bus", bus, "--name", name, *(["--homed"] if homed else [])]
        if rate is not None:
            self._words += ["--rate", str(rate)]

    @property
    def pid(self) -> int:
        """The process."""
        return self._process.pid

    def __enter__(self) -> Self:
        # In a group of its own: Ctrl-C is for the node, which ends it after the controllers.
        self._process = subprocess.Popen(  # noqa: S603  this program
            child_command(self._words),
            start_new_session=True,
        )
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._process.poll() is None:
            self._process.terminate()
        try:
            self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def check(self) -> None:
        """Raise if it has ended.

        Raises:
            HardwareError: It has.
        """
        status = self._process.poll()
        if status is not None:
            raise HardwareError(
                f"the owner of the arm has ended with status {status}; its last message says why"
            )


def require_free(name: str) -> None:
    """Raise if an arm has an owner.

    Raises:
        BusyOwnerError: It has.
    """
    try:
        owner = runtime.find(name)
    except OwnerLostError:
        return
    raise BusyOwnerError(
        f"arm {name} has an owner, process {owner.pid} on {owner.bus}; leave out --bus to use that "
        "arm, or give the one on this bus another name with --arm NAME"
    )
