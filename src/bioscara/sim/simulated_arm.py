"""The simulated arm as one object."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from bioscara.arguments import flag, number, shown, whole
from bioscara.bus import Transaction
from bioscara.clock import SimulatedClock
from bioscara.errors import BioscaraError, InvalidArgumentError
from bioscara.extras import pip_install
from bioscara.protocol import ResetCause
from bioscara.version import __version__

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    from bioscara_firmware_sim import Arm

    Values = npt.NDArray[np.float64]
Step = Callable[[], object]

_BOOT = 0.05
_BOOT_ORIGINAL = 1.0
"""Boot time of an original joint [s]: it turns its motor to and fro for 0.6 s before it answers."""
_OURS, _OURS_V1_FRAMES, _ORIGINAL = range(3)

JOINTS = ("j1", "j2", "j3", "j4")

OVERHEAD = {100e3: 105e-6, 400e3: 80e-6}
"""Time added to a transaction by a Raspberry Pi 4 [s], by bus frequency [Hz]; measured."""


def _native(
    seed: int, frequency: float, overhead: float, firmwares: tuple[int, int, int, int]
) -> Arm:
    try:
        import bioscara_firmware_sim as native  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise BioscaraError(f"the simulated arm is not installed: {_install()}") from error
    except ImportError as error:
        raise BioscaraError(
            f"the simulated arm cannot be loaded, as its installation is damaged or for another "
            f"computer ({error}): {_install('--force-reinstall')}"
        ) from error
    found = getattr(native, "__version__", "older")
    if found != __version__:
        raise BioscaraError(
            f"the simulated arm is version {found}, bioscara {__version__}; install that of the "
            f"same version: {_install()}"
        )
    return native.Arm(seed, frequency, overhead, firmwares)


def _install(*options: str) -> str:
    """Return the command that installs the compiled firmware: of this checkout, if it is one."""
    sources = Path(__file__).parents[3] / "firmware"
    if (sources / "pyproject.toml").is_file():
        return pip_install(*options, str(sources))
    return pip_install(*options, f"bioscara[sim]=={__version__}")


class ArmSnapshot(NamedTuple):
    """The state of a simulated arm at one time, for that arm alone.

    Attributes:
        state: Of the joints.
        supply: Whether the arm has its supply.
        returns: Time after which it has [s].
        unplugged: Joints without a supply.
    """

    state: Arm
    supply: bool
    returns: float
    unplugged: frozenset[str]


class SimulatedArm:
    """Four joints that run their firmware in virtual time.

    Positions are in the joint's unit, rad or m (``j2``). Nothing happens between two calls: time
    passes in :meth:`run`, in waits on :attr:`clock`, and during bus transactions.

    Args:
        seed: Seed of all random numbers; the same seed gives the same run.
        v1: Whether the joints run the original firmware, as on existing arms; or the names of those
            that do.
        v1_frames: Whether the joints that run our firmware know no frames of version 2: our
            firmware as seen by a host that speaks version 1 only.
        controllers_fed: Whether the joints' controllers get 5 V from elsewhere than the arm's
            supply, as by USB: without that supply then only the motors have no power.
        frequency: Bus frequency [Hz], 100e3 or 400e3; None for a bus that takes no time.
        positions: Initial positions of joints, by name; the others start somewhere within their
            range.

    Attributes:
        clock: Its time.
        originals: Names of the joints that run the original firmware.
        controllers_fed: Whether the joints' controllers get 5 V from elsewhere.

    Raises:
        InvalidArgumentError: An unknown joint or frequency.
        BioscaraError: The compiled firmware is not installed.
    """

    def __init__(
        self,
        *,
        seed: int = 0,
        v1: bool | Collection[str] = False,
        v1_frames: bool = False,
        controllers_fed: bool = False,
        frequency: float | None = 100e3,
        positions: Mapping[str, float] | None = None,
    ) -> None:
        seed, originals = whole("seed", seed), _originals(v1)
        self.originals = originals
        self.controllers_fed = flag("controllers_fed", controllers_fed)
        ours = _OURS_V1_FRAMES if flag("v1_frames", v1_frames) else _OURS
        self._supply, self._returns, self._unplugged = True, math.inf, frozenset[str]()
        frequency = None if frequency is None else number("bus frequency", frequency)
        if frequency is not None and frequency not in OVERHEAD:
            raise InvalidArgumentError(
                f"bus frequency {frequency:g} Hz: the arm is simulated at 100e3 and 400e3 Hz, "
                f"or None for no bus time"
            )
        if not 0 <= seed < 2**32:
            raise InvalidArgumentError(f"seed {seed} is outside 0 .. {2**32 - 1}")
        overhead = 0.0 if frequency is None else OVERHEAD[frequency]
        j1, j2, j3, j4 = (_ORIGINAL if name in originals else ours for name in JOINTS)
        self._arm = _native(seed, frequency or 0.0, overhead, (j1, j2, j3, j4))
        self._lost = 0.0
        self.clock = SimulatedClock(self.now, self.run)
        for name, position in (positions or {}).items():
            self.set_position(name, position)
            # Moved before it was switched on, unobserved by its encoder.
            self.reset(name, ResetCause.POWER_ON)
        self._arm.run(_BOOT_ORIGINAL if originals else _BOOT)

    def now(self) -> float:
        """Return the simulated time [s]; it does not go back when a state is restored."""
        return self._arm.now() + self._lost

    def run(self, duration: float) -> None:
        """Let ``duration`` [s] pass."""
        if not (math.isfinite(duration) and duration >= 0.0):
            raise InvalidArgumentError(f"duration {duration} s: must be finite and not negative")
        end = self.now() + duration
        if self._returns <= end:
            self._arm.run(max(self._returns - self.now(), 0.0))
            self.set_supply(True)
        self._arm.run(max(end - self.now(), 0.0))

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | int]:
        """Carry out transactions; an int stands for 1 no acknowledge, 2 timeout."""
        results = self._arm.transfer(transactions)
        if self._returns <= self.now():
            self.set_supply(True)
        return results

    def set_world(
        self, position: Values, velocity: Values, drive: Values, contact: Values, step: Step
    ) -> None:
        """Surround the arm by bodies that another simulator computes.

        ``step`` is called at each multiple of 1.024 ms of the arm's time, also during transactions.
        An exception of it is raised once that time has passed, and the arm then has no world.

        Args:
            position: Receives the positions of the joints a slice ago [rad or m], shape (4,).
            velocity: Receives their velocities a slice ago [rad/s or m/s].
            drive: Receives the mean torque or force on each load since, without contact [N m or N].
            contact: That of bodies on each joint during the next slice; from ``step``.
            step: Moves the bodies by a slice. It must not refer to the arm.
        """
        self._arm.set_world(position, velocity, drive, contact, step)

    def save(self) -> ArmSnapshot:
        """Return the state of the joints: firmware, chips, motors and loads."""
        state = type(self._arm)(self._arm)
        return ArmSnapshot(state, self._supply, self._returns - self.now(), self._unplugged)

    def restore(self, snapshot: ArmSnapshot) -> None:
        """Return to a state of this arm; its time goes on.

        Args:
            snapshot: Of :meth:`save`.
        """
        self._lost += self._arm.now() - snapshot.state.now()
        self._arm.assign(snapshot.state)
        self._supply, self._unplugged = snapshot.supply, snapshot.unplugged
        self._returns = self.now() + snapshot.returns

    # True state, independent of the firmware's measurements.

    def position(self, joint: str) -> float:
        """Return the true position of the joint [rad or m]."""
        return self._arm.position(self._number(joint))

    def velocity(self, joint: str) -> float:
        """Return the true velocity of the joint [rad/s or m/s]."""
        return self._arm.velocity(self._number(joint))

    def load_inertia(self, joint: str) -> float:
        """Return the inertia that the torque on a joint's load accelerates [kg m^2, kg for j2]."""
        return self._arm.load_inertia(self._number(joint))

    def field(self, joint: str) -> float:
        """Return the angle of the motor's field [microsteps of 1/256 step]."""
        return self._arm.field(self._number(joint))

    def load_angle(self, joint: str) -> float:
        """Return the angle from the rotor to the field [microsteps]; 512 is the pull-out."""
        return self._arm.load_angle(self._number(joint))

    def position_error(self, joint: str) -> float:
        """Return the last error of an original joint's closed loop [microsteps].

        It is the field's counter minus the encoder, which the loop sets equal whenever they are 15
        apart, and not the angle from the rotor to the field. 0 for a joint with our firmware.
        """
        return self._arm.position_error(self._number(joint))

    def has_torque(self, joint: str) -> bool:
        """Return whether current flows in the motor."""
        return self._arm.has_torque(self._number(joint))

    # Surroundings.

    def set_position(self, joint: str, position: float) -> None:
        """Set the position at once; a running joint sees a jump of its encoder."""
        self._arm.set_position(self._number(joint), _finite(position, f"{joint} position"))

    def push(self, joint: str, force: float) -> None:
        """Apply a torque [N m] or, on ``j2``, a force [N], until the next call."""
        self._arm.push(self._number(joint), _finite(force, f"force on {joint}"))

    def add_obstacle(self, joint: str, position: float, stiffness: float = 1.0) -> None:
        """Place a wall that blocks the joint.

        Args:
            joint: Name of the joint.
            position: Position of the wall's face that the joint meets.
            stiffness: Stiffness as a share of an end stop's.
        """
        self._arm.add_obstacle(
            self._number(joint), _finite(position, f"obstacle for {joint}"), stiffness
        )

    def clear_obstacles(self, joint: str) -> None:
        """Remove the walls."""
        self._arm.clear_obstacles(self._number(joint))

    def remove_stops(self, joint: str) -> None:
        """Remove the joint's end stops."""
        self._arm.remove_stops(self._number(joint))

    def take_off_belt(self, joint: str) -> None:
        """Remove the joint's belt, so that its motor turns alone."""
        self._arm.take_off_belt(self._number(joint))

    def slip_belt(self, joint: str, distance: float) -> None:
        """Move the joint against its motor by this much, as a slipping belt does."""
        self._arm.slip(self._number(joint), _finite(distance, f"slip of {joint}"))

    def set_friction(self, joint: str, factor: float) -> None:
        """Multiply the friction of the joint."""
        self._arm.set_friction_factor(self._number(joint), _finite(factor, "friction factor"))

    # Faults of the board.

    def reset(self, joint: str, cause: ResetCause = ResetCause.BROWN_OUT) -> None:
        """Restart the joint's controller; a brown-out restarts its chips as well.

        The joint reports a brown-out as PIN, as its board cannot distinguish the two.
        """
        self._arm.reset(self._number(joint), cause)

    def set_power(self, joint: str, on: bool) -> None:
        """Unplug one joint from its supply or plug it in, controller and all."""
        self._number(joint)
        self._unplugged = self._unplugged - {joint} if on else self._unplugged | {joint}
        self._switch(joint)

    def set_supply(self, on: bool, duration: float = math.inf) -> None:
        """Switch the 24 V of the whole arm, as an emergency stop does.

        They feed the controllers, too: all joints are off without them, lose their home, and boot
        when they are back. Where ``controllers_fed``, only the motors have no power.

        Args:
            on: Whether they are on.
            duration: Time after which they are on in any case [s].
        """
        self._supply, self._returns = on, self.now() + duration
        for joint in JOINTS:
            self._switch(joint)

    def _switch(self, joint: str) -> None:
        number, fed = self._number(joint), self._supply or self.controllers_fed
        self._arm.set_motor_power(number, self._supply)
        self._arm.set_power(number, fed and joint not in self._unplugged)

    def hang(self, joint: str, on: bool = True) -> None:
        """Stop the firmware's loop while its I2C interrupt still answers."""
        self._arm.hang(self._number(joint), on)

    def set_watchdog(self, joint: str, on: bool) -> None:
        """Switch the controller's own watchdog on or off."""
        self._arm.set_watchdog(self._number(joint), on)

    def overheat(self, joint: str, on: bool = True) -> None:
        """Make the motor driver report overtemperature."""
        self._arm.overheat(self._number(joint), on)

    def reverse_coil(self, joint: str, on: bool = True) -> None:
        """Plug the motor in the other way: its field turns against the driver's counter."""
        self._arm.reverse_coil(self._number(joint), on)

    def reverse_encoder(self, joint: str, on: bool = True) -> None:
        """Make the encoder count in the opposite direction."""
        self._arm.reverse_encoder(self._number(joint), on)

    def freeze_encoder(self, joint: str, on: bool = True) -> None:
        """Make the encoder repeat its last angle."""
        self._arm.freeze_encoder(self._number(joint), on)

    def corrupt_encoder(self, joint: str, on: bool = True) -> None:
        """Make the encoder's answers fail their check."""
        self._arm.corrupt_encoder(self._number(joint), on)

    def jump_encoder(self, joint: str, turns: float) -> None:
        """Make the encoder's angle jump by this share of a motor turn."""
        self._arm.jump_encoder(self._number(joint), _finite(turns, "encoder jump"))

    def set_stretch(self, duration: float) -> None:
        """Hold the clock low for ``duration`` [s] in each transaction."""
        self._arm.set_stretch(_finite(duration, "clock stretch"))

    def _number(self, joint: str) -> int:
        if joint not in JOINTS:
            raise InvalidArgumentError(f"no joint {joint!r}; the arm has {', '.join(JOINTS)}")
        return JOINTS.index(joint) + 1


def _originals(v1: bool | Collection[str]) -> frozenset[str]:
    if isinstance(v1, bool) or type(v1) not in (tuple, list, set, frozenset):
        return frozenset(JOINTS if flag("v1", v1) else ())
    for name in v1:
        if type(name) is not str or name not in JOINTS:
            raise InvalidArgumentError(f"v1: no joint {shown(name)}; it has {', '.join(JOINTS)}")
    return frozenset(v1)


def _finite(value: float, name: str) -> float:
    if not math.isfinite(value):
        raise InvalidArgumentError(f"{name}: {value} is not a finite number")
    return value
