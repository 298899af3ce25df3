"""Translation of the kernel's errno to a bus error with cause and remedy.

The numbers are those of the two controllers of a Raspberry Pi: ``i2c-bcm2835`` (Pi 4) answers
EREMOTEIO to a missing acknowledge, ETIMEDOUT when the adapter's timeout passes and EIO when its
own clock stretching limit does; ``i2c-designware`` (Pi 5) adds EAGAIN for lost arbitration and
EINVAL for a message it cannot carry. Other adapters answer ENXIO to a missing acknowledge.
"""

from __future__ import annotations

import errno
import grp
import os
import stat
from pathlib import Path

from bioscara.errors import (
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    NoAcknowledgeError,
)

GONE = frozenset({errno.ENODEV, errno.EBADF, errno.ESHUTDOWN, errno.ENOTTY})
"""Errnos after which the open device is unusable."""

_NO_ACKNOWLEDGE = frozenset({errno.EREMOTEIO, errno.ENXIO})
_TIMEOUT = {
    errno.ETIMEDOUT: "the transfer did not end in time",
    errno.EAGAIN: "arbitration was lost: a line was low that should have been high",
    errno.EBUSY: "the bus stayed busy",
    errno.EIO: "the adapter broke the transfer off, as it does when the clock is held low",
}
_SWITCH_ON = (
    "switch I2C on with 'sudo raspi-config nonint do_i2c 0' or with the line "
    "dtparam=i2c_arm=on in /boot/firmware/config.txt, then restart"
)


def transfer_error(error: OSError, path: str, address: int) -> CommunicationError:
    """Return the error of one transaction.

    Args:
        error: Exception of the ioctl.
        path: The device.
        address: 7-bit address of the transaction.
    """
    code = error.errno or 0
    name = errno.errorcode.get(code, str(code))
    where = f"{path}, address {address:#04x}"
    if code in _NO_ACKNOWLEDGE:
        return NoAcknowledgeError(f"{where}: no device acknowledged ({name})", address)
    if code in _TIMEOUT:
        return BusTimeoutError(f"{where}: {_TIMEOUT[code]} ({name})", address)
    if code in GONE:
        return BusUnavailableError(f"{where}: the adapter is gone ({name})", address)
    if code in {errno.EOPNOTSUPP, errno.EINVAL}:
        return CommunicationError(
            f"{where}: the adapter cannot carry this transaction ({name})", address
        )
    return CommunicationError(f"{where}: {os.strerror(code)} ({name})", address)


def open_error(error: OSError, path: str) -> BusUnavailableError:
    """Return why the device could not be opened, and the remedy.

    Args:
        error: Exception of opening it or of reading its functions.
        path: The device.
    """
    if error.errno == errno.ENOENT:
        text = _missing(path)
    elif error.errno in {errno.EACCES, errno.EPERM}:
        text = _forbidden(path)
    elif error.errno in {errno.ENOTTY, errno.EISDIR}:
        text = f"is not an I2C adapter; {_others(path)}"
    elif error.errno in {errno.ENODEV, errno.ENXIO}:
        text = f"has no adapter behind it; {_others(path)}"
    else:
        text = f"cannot be opened: {error.strerror}; {_others(path)}"
    return BusUnavailableError(f"{path} {text}")


def existing_buses(folder: Path) -> list[str]:
    """Return the paths of the I2C devices in ``folder``, by number."""
    found = [
        (int(number), str(entry))
        for entry in folder.glob("i2c-*")
        if (number := entry.name.removeprefix("i2c-")).isdecimal()
    ]
    return [path for _, path in sorted(found)]


def _others(path: str) -> str:
    found = [other for other in existing_buses(Path(path).parent) if other != path]
    return f"buses that exist: {', '.join(found)}" if found else "no other I2C bus exists"


def _missing(path: str) -> str:
    adapter = Path("/sys/bus/i2c/devices") / Path(path).name
    if adapter.exists():
        return "does not exist, its adapter does; load the kernel module: sudo modprobe i2c-dev"
    return f"does not exist ({_others(path)}); {_SWITCH_ON}"


def _forbidden(path: str) -> str:
    group = "i2c"
    try:
        status = os.stat(path)
        if stat.S_ISCHR(status.st_mode) and status.st_gid != 0:
            group = grp.getgrgid(status.st_gid).gr_name
    except (OSError, KeyError):
        group = "i2c"
    return (
        f"may not be opened by this user; join its group with "
        f"'sudo usermod -aG {group} $USER' and log in again"
    )
