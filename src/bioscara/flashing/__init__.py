"""Flashing of firmware images to the joints' boards.

``image`` parses an image and refuses a wrong one before anything is written. ``programmer`` is the
interface to a board: find the only one, write, read back, compare, start. There is one module per
flashing program: ``dfu`` (USB bootloader, dfu-util), ``stflash`` and ``openocd`` (SWD, ST-Link).
``program`` runs such a program; ``access`` explains to users without permission what to install.
Nothing here depends on a bus or a joint.
"""

from bioscara.flashing.dfu import BUTTON as BUTTON, Dfu as Dfu
from bioscara.flashing.image import (
    JOINTS as JOINTS,
    Image as Image,
    known_images as known_images,
    prebuilt as prebuilt,
    read_image as read_image,
)
from bioscara.flashing.openocd import OpenOcd as OpenOcd
from bioscara.flashing.programmer import Programmer as Programmer
from bioscara.flashing.stflash import StFlash as StFlash
