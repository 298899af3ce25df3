"""Distinguishes a stuck bus from a lost joint: whether any other joint can still be asked."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.drivers import acknowledges, line_of
from bioscara.drivers.link.errors import MAY_MOVE
from bioscara.errors import (
    BioscaraError,
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    JointLostError,
    RefusedError,
)
from bioscara.hardware.axis import Axis
from bioscara.protocol import SILENCE

_DOUBTFUL, _CERTAIN = 8, 16
"""Failed transactions in a row after which a lost joint is not the only one, and after which the
bus is stuck in any case: one exchange with four joints and its repetition, and two of them."""


class BusWatch:
    """Finds the cause of failed exchanges.

    A bus is stuck when transactions with all joints, two at least, did not end, with no other
    outcome between them. Joints that were lost before do not count: they are not asked any more.

    Attributes:
        line: Transactions in a row that did not end.
    """

    def __init__(self, bus: Bus, clock: Clock, axes: Sequence[Axis]) -> None:
        self._bus, self._clock, self._axes = bus, clock, axes
        self._boots: dict[str, int] = {}
        self.line = line_of(bus)

    def stuck(self, *, lost: bool) -> BusStuckError | None:
        """Return the stuck bus that the exchanges of a cycle show, or None.

        Nothing is sent to find that out, unless exchanges with some joints alone took so long that
        all others have stopped: these are asked then, as by :meth:`cause`.

        Args:
            lost: Whether a joint has failed for as many cycles as are bridged.
        """
        line = self.line
        expected = self._expected()
        if len(expected) < 2:
            return None
        if not line.addresses.issuperset(expected):
            silent = line.in_a_row and self._clock.now() - line.since >= SILENCE
            return self._ask_others() if silent else None
        if line.stuck is None:
            # Joints that answered nothing for so long have stopped autonomously, so nothing is
            # bridged.
            heard = max(axis.stamp for axis in expected.values())
            late = self._clock.now() - heard >= SILENCE
            if line.in_a_row < (_DOUBTFUL if lost or late else _CERTAIN):
                return None
        return self._error()

    def cause(self, error: BioscaraError, joint: str = "") -> BioscaraError:
        """Return what an exchange with one joint that failed, with its repetitions, shows.

        Where it did not end, the other joints are asked for an acknowledge, one by one until one
        answers or is silent: that takes an adapter timeout for each.

        Args:
            error: Its error.
            joint: Name of the joint; without it, an error of one joint is returned unchanged.

        Returns:
            A stuck bus, a lost joint, or the error itself where it is neither.
        """
        if not isinstance(error, CommunicationError) or isinstance(
            error, RefusedError | BusUnavailableError | JointLostError
        ):
            return error
        if isinstance(error, BusTimeoutError | BusStuckError) and (stuck := self._ask_others()):
            return stuck
        if not joint:
            return error
        return JointLostError(str(error), error.address, joint, 0, error)

    def remember_boots(self) -> None:
        """Note which start of each joint the bus got stuck in."""
        self._boots = _boots(self._axes)

    def restarted(self) -> list[str]:
        """Return the joints that restarted since the bus got stuck; empty if all did, or none."""
        now = _boots(self._axes)
        names = [name for name, boot in self._boots.items() if now.get(name, boot) != boot]
        return names if len(names) < len(self._axes) else []

    def silent(self) -> list[str]:
        """Return the joints that do not acknowledge now; empty if all of them do, or none."""
        names = []
        for axis in self._axes:
            try:
                if not acknowledges(self._bus, self._clock, axis.joint.parameters.address):
                    names.append(axis.name)
            except CommunicationError:
                return []
        return names if len(names) < len(self._axes) else []

    def _ask_others(self) -> BusStuckError | None:
        line, expected = self.line, self._expected()
        for address, axis in expected.items():
            if not line.in_a_row:
                return None
            # A version 1 joint in a pause must not be asked: it would forget its command.
            if address not in line.addresses and not axis.joint.session.paused:
                with suppress(CommunicationError):
                    acknowledges(self._bus, self._clock, address)
        if not line.in_a_row or len(line.addresses.intersection(expected)) < 2:
            return None
        return self._error()

    def _expected(self) -> dict[int, Axis]:
        """Return the joints that were not lost before, by address."""
        return {
            axis.joint.parameters.address: axis
            for axis in self._axes
            if not isinstance(axis.halted, JointLostError)
        }

    def _error(self) -> BusStuckError:
        line = self.line
        duration = self._clock.now() - line.since
        first = next(
            (axis.name for axis in self._axes if axis.joint.parameters.address == line.first), "?"
        )
        told, reopened = line.in_a_row, 0
        if line.stuck is not None:
            # An adapter that knows it does not try all of them.
            transactions, reopened = line.stuck
            told = transactions or told
        text = (
            f"the bus is stuck: {told} transactions in a row with {len(line.addresses)} joints did "
            f"not end, the first, with {first} ({line.first:#04x}), {1e3 * duration:.0f} ms ago"
        )
        if reopened:
            text += f"; re-opening the adapter {reopened} times did not help"
        text += "; a joint, a cable or a short holds a line low"
        if original := ", ".join(axis.name for axis in self._axes if axis.joint.session.original):
            # Nothing stops a move to a position, and one that holds the clock does so until then.
            text += f"; {original} {MAY_MOVE}"
        return BusStuckError(
            text,
            line.first,
            remedy=BusStuckError.REMEDY,
            transactions=told,
            duration=duration,
            reopened=reopened,
        )


def _boots(axes: Sequence[Axis]) -> dict[str, int]:
    """Return the boot ids of the joints that report one."""
    return {axis.name: axis.joint.hello.boot_id for axis in axes if axis.joint.hello is not None}
