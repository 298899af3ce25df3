"""Server that runs a simulated arm in a separate process, in real time."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import stat
import struct
from collections.abc import Callable
from pathlib import Path

from bioscara.bus.user import User, in_use, user_of
from bioscara.clock import Clock, MonotonicClock
from bioscara.errors import BusUnavailableError
from bioscara.model import load_parameters
from bioscara.processes.scheduling import ProcessorWait, wake_on_time
from bioscara.sim.framing import (
    TEXT_MAX,
    ArmState,
    FrameKind,
    Packet,
    check_hello,
    decode_request,
    encode_frame,
    encode_reply,
    encode_state,
    expect,
    next_frame,
)
from bioscara.sim.servo import SimulatedServo
from bioscara.sim.simulated_arm import JOINTS, SimulatedArm

_STEP = 0.002
"""Lag of simulated time behind real time that is allowed without requests [s]."""
_PATIENCE = 0.2
"""Time after a host's last transfer for which the arm's time waits for its next request [s], which
says when it begins. For a host that is late for longer time goes on, as for one that is stopped.
"""
_LAG_MAX = _PATIENCE + 0.25
"""Largest lag that is made up for [s]; a larger one, as when the machine slept, is not."""
_WAIT_REPORTED = 0.05
"""Shortest wait for a processor that is reported when a host leaves [s]."""
FRAME_TIMEOUT = 1.0
"""Time that a client has for a whole frame, its HELLO included, and to take a reply [s]."""
_CLIENTS_MAX = 16
"""Maximum number of connections: the host, and clients that have not sent a HELLO yet."""
_LOOK_PERIOD = 0.01
"""Least time between two answers to a program that only looks [s]."""
_SEQUENCES = 2**32
_RECEIVE = 2**16
_CREDENTIALS = struct.Struct("=iII")
"""The kernel's answer to SO_PEERCRED: process, user and group."""


def serve(
    arm: SimulatedArm,
    path: str | Path,
    cancelled: Callable[[], bool],
    clock: Clock | None = None,
    listening: Callable[[], None] = lambda: None,
    report: Callable[[str], None] = lambda _: None,
    servo: SimulatedServo | None = None,
) -> None:
    """Run the arm behind a Unix socket until ``cancelled``.

    One host at a time; the next is refused with the name and process id of the connected one. The
    joints keep running when a host vanishes, which is intended, and no client can delay their time:
    one that sends or receives too slowly, or sends an invalid frame, is disconnected. Only its
    owner can access the socket.

    Where host or server are late because other programs have the processors, the arm's time waits
    for them. It waits neither for a host that is stopped or takes long itself, nor for longer than
    0.2 s at once: the joints then stop by their watchdog, as without a host.

    Programs that only look at the arm get its true positions, without the host and the bus.

    Args:
        arm: The arm.
        path: Path of the socket; a socket without a listener is replaced.
        cancelled: Called every few milliseconds.
        clock: Real time; the machine's monotonic clock by default, as that of the hosts.
        listening: Called once clients can connect.
        report: Receives a sentence when a host leaves for which the arm's time waited.
        servo: The servo of its gripper; a new one if None. Hosts find its PWM output at
            :func:`pwm_folder`.

    Raises:
        BusUnavailableError: The socket cannot be created, or already has a listener.
    """
    path = str(path)
    listener = _listen(path)
    if servo is None:
        servo = SimulatedServo(load_parameters().gripper.outputs[0])
    output = pwm_folder(path)
    server = _Server(arm, listener, MonotonicClock() if clock is None else clock, report)
    wake_on_time()
    try:
        output.unlink(missing_ok=True)
        output.symlink_to(servo.root)
        listening()
        while not cancelled():
            server.step()
    finally:
        server.close()
        listener.close()
        for made in (path, output):
            with contextlib.suppress(FileNotFoundError):
                os.unlink(made)


def pwm_folder(path: str | Path) -> Path:
    """Return the folder of the PWM outputs of a simulated arm, in place of ``/sys/class/pwm``.

    Args:
        path: Path of the arm's socket.
    """
    return Path(f"{path}.pwm")


class _Client:
    """One connection; nothing here waits for the other side.

    Attributes:
        host: The program; None before its HELLO, and for one that only looks.
        sequence: Number of the next frame from it.
        deadline: Time limit of a transfer in progress, in either direction [s]; None without one.
        due: Time before which its next request is not carried out [s].
        waited: For how long the arm's time had stood still when it became the host [s].
    """

    def __init__(self, connection: socket.socket, now: float) -> None:
        connection.setblocking(False)
        self.connection = connection
        self.host: User | None = None
        self.sequence = 0
        self.deadline: float | None = now + FRAME_TIMEOUT
        self.due = now
        self.waited = 0.0
        self._inbox, self._outbox = bytearray(), bytearray()

    @property
    def replying(self) -> bool:
        """Whether a reply is in progress; the next request is processed only afterwards."""
        return bool(self._outbox)

    def receive(self) -> None:
        """Read the received bytes; at most those that fit into one call.

        Raises:
            OSError: The client is gone.
        """
        try:
            part = self.connection.recv(_RECEIVE)
        except BlockingIOError:
            return
        if not part:
            raise ConnectionAbortedError("closed by the client")
        self._inbox += part

    def next_frame(self, now: float) -> Packet | None:
        """Return the next whole frame; a partial one gets a deadline with its first byte.

        Raises:
            BusUnavailableError: The received bytes are no frame.
        """
        frame = next_frame(self._inbox)
        if self.host is not None:
            if frame is not None or not self._inbox:
                self.deadline = None
            elif self.deadline is None:
                self.deadline = now + FRAME_TIMEOUT
        return frame

    def reply(self, frame: bytes, now: float, due: float) -> None:
        """Send ``frame``; the next request has to wait until ``due``.

        Raises:
            OSError: The client is gone.
        """
        self._outbox += frame
        self.due, self.deadline = due, now + FRAME_TIMEOUT
        self.send()

    def send(self) -> None:
        """Send as much of the reply as the client accepts.

        Raises:
            OSError: The client is gone.
        """
        with contextlib.suppress(BlockingIOError):
            del self._outbox[: self.connection.send(self._outbox)]
        if not self._outbox and self.host is not None:
            self.deadline = None

    def user(self) -> User:
        """Return the program that connected, as the kernel knows it."""
        answer = self.connection.getsockopt(
            socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size
        )
        return user_of(_CREDENTIALS.unpack(answer)[0])

    def gone(self) -> bool:
        """Return whether the other side has closed, even if it sent data before."""
        poll = select.poll()
        poll.register(self.connection, 0)
        return bool(poll.poll(0))

    def refuse(self, why: str) -> None:
        """Send the reason as far as the client accepts it."""
        text = why.encode()[:TEXT_MAX]
        with contextlib.suppress(OSError):
            self.connection.send(encode_frame(FrameKind.REFUSAL, 0, text))


class _Server:
    """The arm in real time, and its clients."""

    def __init__(
        self,
        arm: SimulatedArm,
        listener: socket.socket,
        wall: Clock,
        report: Callable[[str], None],
    ) -> None:
        self._arm, self._listener, self._wall, self._report = arm, listener, wall, report
        listener.setblocking(False)
        self._clients: list[_Client] = []
        self._offset = wall.now() - arm.now()
        self._processor, self._waited, self._reported = ProcessorWait(), 0.0, 0.0

    def step(self) -> None:
        """Wait briefly for clients, advance the arm, and serve the clients that are ready."""
        now = self._wall.now()
        waiting = {
            client.connection: client
            for client in self._clients
            if not client.replying and client.due <= now
        }
        timeout = min([_STEP, *(each.due - now for each in self._clients if each.due > now)])
        ready, _, _ = select.select([self._listener, *waiting], [], [], timeout)
        self._skip_pause()
        for socket_ in ready:
            if socket_ is self._listener:
                self._accept()
            else:
                self._serve_client(waiting[socket_], self._receive)
        for client in tuple(self._clients):
            self._serve_client(client, self._continue)
        now = self._wall.now()
        if not any(client.host and now < client.due + _PATIENCE for client in self._clients):
            self._run_until(now)

    def close(self) -> None:
        """Disconnect all clients."""
        for client in tuple(self._clients):
            self._drop(client)

    def _skip_pause(self) -> None:
        """Drop a lag that is too large to be made up for."""
        lag = self._wall.now() - self._offset - self._arm.now()
        if lag > _LAG_MAX:
            self._offset += lag - _STEP

    def _run_until(self, time: float) -> None:
        """Run the arm until a real time [s], unless it is beyond that already."""
        lag = time - self._offset - self._arm.now()
        if lag > 0.0:
            self._arm.run(lag)

    def _wait(self, starved: float, time: float) -> None:
        """Let the arm's time stand still for a wait for a processor, up to a real time [s]."""
        lag = time - self._offset - self._arm.now()
        waited = max(min(starved, lag), 0.0)
        self._offset += waited
        self._waited += waited

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return  # Already gone again.
        client = _Client(connection, self._wall.now())
        self._clients.append(client)
        if len(self._clients) > _CLIENTS_MAX:
            client.refuse(f"it has {_CLIENTS_MAX} connections, and no more; end those programs")
            self._drop(client)

    def _serve_client(self, client: _Client, step: Callable[[_Client], None]) -> None:
        """Serve one client; disconnect it if it is gone or violates the protocol."""
        try:
            step(client)
        except OSError:
            self._drop(client)
        except BusUnavailableError as error:
            client.refuse(str(error))
            self._drop(client)

    def _receive(self, client: _Client) -> None:
        client.receive()
        self._answer(client)

    def _continue(self, client: _Client) -> None:
        """Continue with a reply or with received requests; raise if a client exceeds its time."""
        now = self._wall.now()
        if client.replying:
            client.send()
        if not client.replying and client.due <= now:
            self._answer(client)
        if client.deadline is not None and now > client.deadline:
            raise BusUnavailableError(f"it waits at most {FRAME_TIMEOUT:g} s for a whole frame")

    def _answer(self, client: _Client) -> None:
        now = self._wall.now()
        frame = client.next_frame(now)
        if frame is None:
            return
        if client.host is None and frame.kind is FrameKind.LOOK:
            self._show(client, frame, now)
        elif client.host is None:
            check_hello(expect(frame, FrameKind.HELLO, 0))
            self._welcome(client, now)
        else:
            request, begin, starved = decode_request(
                expect(frame, FrameKind.REQUEST, client.sequence)
            )
            # This process may wake up late: on the bus the request begins when it was sent.
            begin = min(begin, now)
            self._wait(starved, begin)
            self._run_until(begin)
            results = self._arm.transfer(request)
            # Not later for the host than on a bus, where this process had no processor.
            now = self._wall.now()
            self._wait(self._processor.lap(), now)
            # The transfer took bus time: continuous requests must not make the arm run faster.
            end = self._arm.now() + self._offset
            body = encode_reply(results, end, self._waited - client.waited)
            client.reply(encode_frame(FrameKind.REPLY, client.sequence, body), now, end)
        client.sequence = (client.sequence + 1) % _SEQUENCES

    def _show(self, client: _Client, frame: Packet, now: float) -> None:
        """Answer a LOOK: no bus transaction takes place, and no simulated time passes."""
        expect(frame, FrameKind.LOOK, client.sequence)
        arm = self._arm
        body = encode_state(ArmState(arm.now(), tuple(arm.position(joint) for joint in JOINTS)))
        client.reply(encode_frame(FrameKind.STATE, client.sequence, body), now, now + _LOOK_PERIOD)

    def _welcome(self, client: _Client, now: float) -> None:
        user = client.user()
        for other in tuple(self._clients):
            if other.host is None:
                continue
            if not other.gone():
                raise BusUnavailableError(in_use("it", other.host, user.pid))
            self._drop(other)
        client.host, client.waited = user, self._waited
        client.reply(
            encode_frame(FrameKind.WELCOME, 0), now, max(now, self._arm.now() + self._offset)
        )

    def _drop(self, client: _Client) -> None:
        if client in self._clients:
            self._clients.remove(client)
        client.connection.close()
        waited = self._waited - self._reported
        if client.host is not None and waited >= _WAIT_REPORTED:
            self._reported = self._waited
            self._report(
                f"the computer was busy: the arm's time waited {waited:.2f} s for a processor "
                f"while {client.host} used it"
            )


def _listen(path: str) -> socket.socket:
    if _is_socket(path) and not _alive(path):
        os.unlink(path)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    mask = os.umask(0o177)
    try:
        listener.bind(path)
    except OSError as error:
        listener.close()
        raise BusUnavailableError(
            f"cannot make the socket {path}: {error.strerror or error}; choose another path with "
            f"--socket, or end the arm that listens there"
        ) from error
    finally:
        os.umask(mask)
    listener.listen(socket.SOMAXCONN)
    return listener


def _is_socket(path: str) -> bool:
    try:
        return stat.S_ISSOCK(os.lstat(path).st_mode)
    except OSError:
        return False


def _alive(path: str) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        # An arm whose process hangs accepts no connection, and must not be waited for.
        probe.setblocking(False)
        try:
            probe.connect(path)
        except BlockingIOError:
            return True
        except OSError:
            return False
    return True
