"""A day of a served arm: random goals, clients that die, faults; run by ``make soak``.

The simulated arm is as fast as this computer allows. Programs come and go; some are killed in the
middle of a motion, some take the lease from others, stop the arm or let a joint fail. At the end no
event is missing, each accepted goal has ended exactly once, each fault was caused here, and the
owner's memory is that of the first hours.

``BIOSCARA_SOAK_HOURS`` is the arm's time, 24 unless given, and ``BIOSCARA_SOAK_SEED`` the seed.
"""

from __future__ import annotations

import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import ExitStack, suppress
from pathlib import Path

from bioscara import BioscaraError, JointVelocity, LeaseError
from bioscara.api import messages as m
from bioscara.errors import FaultedError, OwnerLostError
from bioscara.remote import RemoteRobot
from bioscara.remote.link import OwnerLink

HOURS = float(os.environ.get("BIOSCARA_SOAK_HOURS", "24"))
SEED = int(os.environ.get("BIOSCARA_SOAK_SEED", str(random.randrange(2**32))))
NAME = "soak"
SERVE = ("serve", "--name", NAME, "--real-time-factor", "1000", "--rate", "50")
"""How the arm is served: the cycles of a day take half as long as at 100 Hz."""
GROWTH = 8 << 20
"""Memory that the owner may have gained since the first quarter [byte]: its rings fill up."""
FAULTS = ("obstacle", "reset", "supply", "hang")
CAUSED = 60.0
"""Time after which a fault is not that of the last cause any more [s of the arm]."""


def work(seed: int) -> None:
    """Use the arm at random for a while, as one program of many."""
    rng = random.Random(seed)
    with RemoteRobot(NAME) as robot:
        for _ in range(rng.randrange(2, 15)):
            with suppress(BioscaraError):
                act(robot, rng)


def act(robot: RemoteRobot, rng: random.Random) -> None:
    """Do one thing with the arm."""
    try:
        if robot.faults:
            robot.acknowledge()
            robot.recover()
        if not robot.is_homed:
            robot.home()
            robot.unfold()
        choice = rng.random()
        goal = rng.uniform(-1.2, 1.2), rng.uniform(0.05, 0.3), rng.uniform(-1.0, 1.0), 0.0
        if choice < 0.5:
            robot.move_joints(goal, velocity_scaling=rng.uniform(0.2, 1.0))
        elif choice < 0.6:
            robot.gripper.move(rng.uniform(0.05, 0.11))
        elif choice < 0.7:
            steps = iter(range(rng.randrange(1, 20)))
            velocity = JointVelocity(j1=rng.uniform(-0.2, 0.2))
            robot.jog(lambda: None if next(steps, None) is None else velocity)
        elif choice < 0.8:
            motion = robot.move_joints(goal, wait=False)
            motion.pause()
            motion.resume()
            motion.cancel()
            motion.wait()
        elif choice < 0.9:
            robot.execute(robot.plan.move_joints(goal))
        elif choice < 0.95:
            robot.disable()
        else:
            robot.stop()
    except LeaseError:
        robot.acquire_lease(force=rng.random() < 0.2)
    except FaultedError:
        robot.acquire_lease(force=True)


class Watcher:
    """Sees all events, and judges them."""

    def __init__(self) -> None:
        self.numbers: list[int] = []
        self.accepted: Counter[int] = Counter()
        self.ended: Counter[int] = Counter()
        self.faults: list[m.Event] = []
        self.lost: OwnerLostError | None = None

    def take(self, message: m.FromOwner) -> None:
        """Take an event."""
        if not isinstance(message, m.Event):
            return
        self.numbers.append(message.number)
        if message.what == "fault":
            self.faults.append(message)
        if message.goal is not None and message.what == "goal_accepted":
            self.accepted[message.goal.goal] += 1
        if message.goal is not None and message.what == "goal_ended":
            self.ended[message.goal.goal] += 1

    def lose(self, error: OwnerLostError) -> None:
        """Note that the owner has ended."""
        self.lost = error


def main() -> int:
    """Soak the owner; return the exit status."""
    print(f"seed {SEED}, {HOURS:g} h of the arm's time", flush=True)
    rng = random.Random(SEED)
    # The owner ends with this program, also where that is ended by a signal.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="b"))
        os.environ["BIOSCARA_RUNTIME"] = folder
        log = stack.enter_context(Path(folder, "owner.log").open("w+"))
        owner = subprocess.Popen(
            [sys.executable, "-m", "bioscara", *SERVE],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
        stack.callback(owner.kill)
        assert owner.stdout
        while "is served" not in owner.stdout.readline():
            pass
        watcher = Watcher()
        link = OwnerLink(NAME, watcher.take, watcher.lose, events_after=0)
        link.open()
        stack.callback(link.close)
        causes, memory, killed = soak(link, watcher, rng)
        problems = judge(watcher, causes, memory)
        owner.send_signal(signal.SIGTERM)
        if owner.wait(60) != 0:
            problems.append(f"the owner ended with status {owner.returncode}")
        log.seek(0)
        last = log.readlines()[-20:]
    print(
        f"{len(watcher.numbers)} events, {sum(watcher.accepted.values())} goals, "
        f"{len(watcher.faults)} faults of {len(causes)} causes, {killed} programs killed, memory "
        f"{memory[0] / 2**20:.1f} to {memory[-1] / 2**20:.1f} MiB"
    )
    for problem in problems:
        print(f"soak: {problem}", file=sys.stderr)
    if problems:
        print("".join(last), file=sys.stderr)
    return 1 if problems else 0


def soak(
    link: OwnerLink, watcher: Watcher, rng: random.Random
) -> tuple[list[float], list[int], int]:
    """Let programs use the arm; return when faults were caused, memory, and programs killed."""
    causes: list[float] = []
    memory: list[int] = []
    programs: list[tuple[subprocess.Popen[bytes], float]] = []
    killed = 0
    begin = shown = time.monotonic()
    while (now := state(link).time) < 3600.0 * HOURS and watcher.lost is None:
        while len(programs) < 3:
            command = [sys.executable, "-m", "tests.soak", str(rng.randrange(2**32))]
            program = subprocess.Popen(command, stderr=subprocess.DEVNULL)
            patience = rng.expovariate(1 / 5.0) if rng.random() < 0.4 else 60.0
            programs.append((program, time.monotonic() + patience))
        for entry in list(programs):
            program, end = entry
            if program.poll() is None and time.monotonic() > end:
                program.kill()
                program.wait()
                killed += 1
            if program.returncode is not None:
                programs.remove(entry)
        if rng.random() < 0.01:
            causes.append(now)
            cause(link, rng)
        memory.append(statistic(link).memory)
        if time.monotonic() - shown > 10.0:
            shown = time.monotonic()
            speed = now / (shown - begin)
            size = memory[-1] / 2**20
            print(f"{now / 3600:.2f} h, {speed:.0f} times real time, {size:.1f} MiB", flush=True)
        time.sleep(0.2)
    for program, _ in programs:
        program.kill()
        program.wait()
    # The lease of the last one lapses, and its motion ends.
    time.sleep(5.0)
    return causes, memory, killed


def cause(link: OwnerLink, rng: random.Random) -> None:
    """Let a joint fail, and repair it a moment later."""
    fault, joint = rng.choice(FAULTS), f"j{rng.randrange(1, 5)}"
    off = {"obstacle": 0.1, "reset": 1.0, "supply": 0.0, "hang": 1.0}[fault]
    repair = {
        "obstacle": m.SimulateFault("clear_obstacles", joint),
        "supply": m.SimulateFault("supply", joint, 1.0),
        "hang": m.SimulateFault("hang", joint, 0.0),
    }.get(fault)
    link.request(m.SimulateFault(fault, joint, off))
    time.sleep(0.3)
    if repair is not None:
        link.request(repair)


def judge(watcher: Watcher, causes: list[float], memory: list[int]) -> list[str]:
    """Return the problems."""
    problems = []
    if watcher.lost is not None:
        problems.append(str(watcher.lost))
    if watcher.numbers != list(range(1, len(watcher.numbers) + 1)):
        problems.append("events are missing, twice or out of order")
    for goal in watcher.accepted | watcher.ended:
        if (watcher.accepted[goal], watcher.ended[goal]) != (1, 1):
            counts = watcher.accepted[goal], watcher.ended[goal]
            problems.append(f"goal {goal} was accepted and ended {counts} times")
    for fault in watcher.faults:
        if not any(0.0 <= fault.time - caused + 1.0 <= CAUSED for caused in causes):
            problems.append(f"a fault without a cause at {fault.time:.1f} s: {fault.text}")
    quarter = max(len(memory) // 4, 1)
    before, after = statistics.median(memory[quarter : 2 * quarter]), memory[-1]
    if after - before > GROWTH:
        problems.append(f"the memory grew from {before / 2**20:.1f} to {after / 2**20:.1f} MiB")
    return problems


def state(link: OwnerLink) -> m.StateSample:
    """Return the state of the arm."""
    result = link.request(m.GetState())
    assert isinstance(result, m.StateSample)
    return result


def statistic(link: OwnerLink) -> m.Statistics:
    """Return the statistics of the owner."""
    result = link.request(m.GetStatistics())
    assert isinstance(result, m.Statistics)
    return result


if __name__ == "__main__":
    if len(sys.argv) > 1:
        with suppress(OwnerLostError):
            work(int(sys.argv[1]))
        sys.exit(0)
    sys.exit(main())
