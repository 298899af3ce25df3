"""A Linux bus in a process of its own, in front of a pretended I2C device.

``i2c_shim.c`` must be preloaded before Python starts, so the bus lives in a child process
(``preloaded_process.py``) and :class:`PreloadedBus` passes every call on to it.
"""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from bioscara.bus import Bus, Transaction
from bioscara.errors import BioscaraError, CommunicationError

HERE = Path(__file__).parent
DEVICE = "/dev/i2c-1"


def build_shim(folder: Path) -> Path:
    """Compile the shim into ``folder``; a machine without compiler fails the test."""
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    if compiler is None:
        raise RuntimeError(
            "the tests of the Linux bus need a C compiler for tests/contract/i2c_shim.c: "
            "on Debian and Ubuntu, apt install gcc libc6-dev"
        )
    library = folder / "i2c_shim.so"
    flags = ["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    built = subprocess.run(
        [compiler, *flags, str(HERE / "i2c_shim.c"), "-o", str(library), "-ldl", "-lpthread"],
        capture_output=True,
        text=True,
        check=False,
    )
    if built.returncode:
        raise RuntimeError(f"tests/contract/i2c_shim.c does not compile:\n{built.stderr}")
    return library


class PreloadedBus(Bus):
    """A :class:`~bioscara.bus.LinuxBus` behind the shim.

    Args:
        shim: The compiled shim.
        socket: Socket of the simulated arm.
        rules: ``pi4``, ``pi5`` or nothing, see the shim.
    """

    def __init__(self, shim: Path, socket: str | Path, rules: str = "") -> None:
        source = str(HERE.parents[1] / "src")
        environment = os.environ | {
            "LD_PRELOAD": str(shim),
            "BIOSCARA_SHIM_DEVICE": DEVICE,
            "BIOSCARA_SHIM_SOCKET": str(socket),
            "BIOSCARA_SHIM_RULES": rules,
            "PYTHONPATH": os.pathsep.join((source, os.environ.get("PYTHONPATH", ""))),
        }
        self._process = subprocess.Popen(
            [sys.executable, str(HERE / "preloaded_process.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
        )

    def call(self, name: str, *arguments: object) -> object:
        """Call a function of the process, see there; with its exceptions."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        pickle.dump((name, arguments), process.stdin)
        process.stdin.flush()
        answer = pickle.load(process.stdout)
        if isinstance(answer, BioscaraError):
            raise answer
        return answer

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        return self.call("transfer", list(transactions))  # type: ignore[return-value]

    def smbus2(self, messages: Sequence[Transaction]) -> list[bytes] | int:
        """Carry these out in one ioctl of smbus2; returns the bytes read, or the errno."""
        return self.call("smbus2", list(messages))  # type: ignore[return-value]

    def shim(self, name: str, *arguments: int) -> int:
        """Call a function of the shim."""
        return self.call("shim", name, *arguments)  # type: ignore[return-value]

    def statistics(self) -> tuple[int, ...]:
        """The counters of the Linux bus."""
        return self.call("statistics")  # type: ignore[return-value]

    def close(self) -> None:
        """Close the bus; the process keeps running and answers further requests."""
        self.call("close")

    def quit(self) -> None:
        """End the process."""
        with self._process as process:
            try:
                process.communicate(timeout=20)
            finally:
                process.kill()
        assert process.returncode == 0
