"""The firmware of Bioscara's joints, compiled for this machine, with its world simulated."""

from bioscara_firmware_sim._native import Arm as Arm, Plant as Plant, __version__ as __version__
