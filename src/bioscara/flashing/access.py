"""Installation advice for users without permission to use a board or an ST-Link."""

from __future__ import annotations

import shlex
from pathlib import Path

from bioscara.errors import FlashError

RULES = Path(__file__).with_name("70-bioscara-flash.rules")
"""The udev rules that let the group plugdev, and locally logged-in users, use the devices."""


def not_permitted(device: str) -> FlashError:
    """Return the error for a device that may not be opened.

    Args:
        device: Description of the device, for the message.
    """
    rules = shlex.quote(str(RULES))
    return FlashError(
        f"no permission to use {device}: install the udev rule (sudo cp {rules} "
        "/etc/udev/rules.d/ && sudo udevadm control --reload && sudo udevadm trigger) and see "
        "that you are in the group plugdev (sudo usermod -aG plugdev $USER, then log in again)"
    )
