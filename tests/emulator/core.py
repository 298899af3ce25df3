"""The core of the firmware in a flashed image, with its board replaced: calls alone, without time.

The functions of the class ``Board`` are replaced, by their places in its virtual table. All others
are executed as they are flashed.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import unicorn as u
from unicorn import arm_const as arm

from emulator.clock import FLASH, FLASH_SIZE, RAM, RAM_SIZE
from emulator.elf import Image

FUNCTIONS = (
    "micros",
    "driver_exchange",
    "encoder_exchange",
    "driver_enable",
    "reset_cause",
    "boot_id",
    "feed_watchdog",
    "bus_errors",
    "image",
    "exception",
    "indicate",
    "enter_bootloader",
    "lock",
    "unlock",
)
"""Virtual functions of the class ``Hal`` (firmware/joint/src/core/hal.h), in their order."""

_CALLER = FLASH + FLASH_SIZE - 4
"""To where calls from outside return."""
_STACK = RAM + RAM_SIZE
_BUFFER = RAM + RAM_SIZE - 16384
"""Memory for the arguments of calls from outside, far below the stack."""
_RETURN = b"\x70\x47"
_ARGUMENTS = (arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3)
_JOINT = "_ZN8bioscara12_GLOBAL__N_15jointE"
_WIRE = "_ZN8bioscara4Wire4bootEv"


class Core:
    """A joint, as its image makes it.

    Args:
        path: The ELF file.
        functions: Those of the board, by name; called with the first three arguments, an int each,
            they return the result.
    """

    def __init__(self, path: Path, functions: dict[str, Callable[[int, int, int], int]]) -> None:
        image = Image(path)
        self._symbols = image.symbols
        self._engine = engine = u.Uc(u.UC_ARCH_ARM, u.UC_MODE_THUMB | u.UC_MODE_MCLASS)
        engine.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        engine.mem_map(FLASH, FLASH_SIZE)
        engine.mem_map(RAM, RAM_SIZE)
        for address, content in image.segments:
            engine.mem_write(address, content)
        begin, end, load = (image.symbols[each] for each in ("data_start", "data_end", "data_load"))
        engine.mem_write(begin, bytes(engine.mem_read(load, end - begin)))
        self._failed: BaseException | None = None
        table = image.symbols["_ZTVN8bioscara5BoardE"] + 8
        for index, name in enumerate(FUNCTIONS):
            (address,) = struct.unpack("<I", engine.mem_read(table + 4 * index, 4))
            self._replace(address & ~1, functions[name])
        self._wire = 0
        self._watch(image.symbols[_WIRE] & ~1, self._note_wire)
        first, last = image.symbols["init_array_start"], image.symbols["init_array_end"]
        for (constructor,) in struct.iter_unpack("<I", engine.mem_read(first, last - first)):
            self._run(constructor)

    def boot(self) -> None:
        """Power-up."""
        self._run(self._symbols["_ZN8bioscara5Joint4bootEv"], self._symbols[_JOINT])

    def tick(self) -> None:
        """One control period."""
        self._run(self._symbols["_ZN8bioscara5Joint4tickEv"], self._symbols[_JOINT])

    def receive(self, frame: bytes) -> None:
        """Take a frame of the host."""
        self._engine.mem_write(_BUFFER, frame)
        self._run(self._symbols["_ZN8bioscara4Wire7receiveEPKhj"], self._wire, _BUFFER, len(frame))

    def request(self) -> bytes:
        """Return the answer."""
        self._run(self._symbols["_ZNK8bioscara4Wire7requestERA13_h"], self._wire, _BUFFER)
        return self.memory(_BUFFER, self._engine.reg_read(arm.UC_ARM_REG_R0))

    def memory(self, address: int, size: int) -> bytes:
        """Return bytes of the joint's memory."""
        return bytes(self._engine.mem_read(address, size))

    def store(self, address: int, content: bytes) -> None:
        """Write bytes into it."""
        self._engine.mem_write(address, content)

    def _watch(self, address: int, call: Callable[[], object]) -> None:
        def reached(*_: object) -> None:
            try:
                call()
            except BaseException as error:  # noqa: BLE001  raised by _run()
                self._failed = error
                self._engine.emu_stop()

        self._engine.hook_add(u.UC_HOOK_CODE, reached, begin=address, end=address)

    def _replace(self, address: int, function: Callable[[int, int, int], int]) -> None:
        def called() -> None:
            arguments = [self._engine.reg_read(each) for each in _ARGUMENTS[1:]]
            self._engine.reg_write(_ARGUMENTS[0], function(*arguments))

        self._engine.mem_write(address, _RETURN)
        self._watch(address, called)

    def _note_wire(self) -> None:
        self._wire = self._engine.reg_read(_ARGUMENTS[0])

    def _run(self, function: int, *arguments: int) -> None:
        engine = self._engine
        for register, value in zip(_ARGUMENTS, arguments, strict=False):
            engine.reg_write(register, value)
        engine.reg_write(arm.UC_ARM_REG_SP, _STACK)
        engine.reg_write(arm.UC_ARM_REG_LR, _CALLER | 1)
        engine.emu_start(function | 1, _CALLER)
        if self._failed is not None:
            raise self._failed
