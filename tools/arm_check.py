"""Install and use bioscara on the arm's own kind of computer, emulated: ``make arm-check``.

It makes the userland of Raspberry Pi OS (Debian for arm64) in a temporary folder and runs it with
QEMU in namespaces of its own, so that nothing of this computer is changed. There it compiles the
simulation, installs the wheel and runs ``try_installed.py``; samples of the demo and plans have to
be the same to the bit as on this computer. Where that cannot be, a sentence says why, and nothing
is checked.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tools import release
from tools.generated import ROOT
from tools.release_check import installed, say, tried_out

SUITE = "bookworm"
PACKAGES = "python3,python3-venv,python3-pip,python3-dev,g++,bash,dash,coreutils,sed"
MIRROR = f"deb http://deb.debian.org/debian {SUITE} main"
_UNSHARE = ("unshare", "--user", "--map-root-user", "--mount", "--pid", "--fork")
_ELF_OF_ARM64 = (
    r"\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00",
    r"\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff",
)
"""First bytes of a program for arm64, and which of their bits count: binfmt_misc of the kernel."""
_REGISTER = """
mount -t binfmt_misc none /proc/sys/fs/binfmt_misc
printf '%s' ':arm64:M::{magic}:{mask}:{qemu}:F' >/proc/sys/fs/binfmt_misc/register
"""
_INSIDE = """
set -e
{register}
cd {root}
mount --rbind /dev dev
mount -t proc proc proc
for file in etc/resolv.conf etc/hosts; do touch $file; mount --bind /$file $file; done
mkdir -p etc/ssl/certs
mount --rbind /etc/ssl/certs etc/ssl/certs
export HOME=/root PATH=/usr/sbin:/usr/bin:/bin LANG=C.UTF-8 PIP_CONFIG_FILE=/dev/null
exec chroot . /bin/sh -ec '
cd /root
python3 -m venv /opt/bioscara
pip="/opt/bioscara/bin/pip install -q"
$pip *.whl
$pip --no-deps ./bioscara_firmware_sim-*.gz
$pip --find-links . "bioscara[sim,web]"
mkdir empty
cd empty
exec /opt/bioscara/bin/python ../try_installed.py'
"""
"""Commands in the namespaces; the kernel keeps QEMU open, which therefore is not in the root."""


def obstacle(folder: Path) -> str | None:
    """Return why the check is not possible here, None if it is.

    Args:
        folder: A temporary one.
    """
    if platform.machine() != "x86_64" or sys.platform != "linux":
        return f"it emulates arm64 on x86-64 Linux, and this is {platform.machine()}"
    if os.geteuid() != 0:
        return "it unpacks packages of Debian with their owners, for which it has to be root"
    missing = [name for name in ("apt-get", "dpkg", "perl", "unshare") if not shutil.which(name)]
    if missing:
        return f"it needs {', '.join(missing)}: it is for Debian and Ubuntu"
    found = subprocess.run(
        [*_UNSHARE, "sh", "-c", "mount -t binfmt_misc none /proc/sys/fs/binfmt_misc"],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if found.returncode:
        return f"this computer refuses namespaces with formats of their own: {found.stderr.strip()}"
    return None


def main() -> int:
    """Check; return the exit status."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        reason = obstacle(folder)
        if reason is not None:
            say(f"not run: arm-check, as {reason}")
            return 0
        try:
            return _check(folder)
        except subprocess.CalledProcessError as error:
            sys.stderr.write(f"{error}\n{error.stdout or ''}{error.stderr or ''}")
            return 1


def _check(folder: Path) -> int:
    say("building both distributions")
    release.build(folder / "dist")
    say(f"unpacking Debian {SUITE} for arm64")
    root = _userland(folder)
    home = root / "root"
    for path in (*(folder / "dist").glob("bioscara*-py3-none-any.whl"),
                 *(folder / "dist").glob("bioscara_firmware_sim*.gz"),
                 ROOT / "tools/try_installed.py", ROOT / "tools/motion_bits.py"):  # fmt: skip
        shutil.copy(path, home)
    say("compiling the simulation and using it there: about four minutes")
    (qemu,) = (folder / "tools").glob("usr/bin/qemu-aarch64-static")
    magic, mask = _ELF_OF_ARM64
    register = _REGISTER.format(magic=magic, mask=mask, qemu=qemu)
    script = _INSIDE.format(register=register, root=root)
    with subprocess.Popen([*_UNSHARE, "sh", "-c", script]) as emulated:
        here = installed(Path(sys.executable), folder / "dist", folder / "here")
        output, _ = tried_out(here).communicate()
    say(f"the same on this computer\n{output.rstrip()}")
    status = int(emulated.returncode != 0)
    for name in ("samples.csv", "plans.txt"):
        there, lines = ((where / name).read_text().splitlines() for where in (home / "empty", here))
        different = sum(a != b for a, b in zip(there, lines, strict=False))
        different += abs(len(there) - len(lines))
        say(f"{name}: {different or 'none'} of {len(lines)} lines differ")
        status |= different > 0
    return status


def _userland(folder: Path) -> Path:
    """Unpack QEMU and the packages for arm64; return the root of these."""
    tools, root = folder / "tools", folder / "root"
    tools.mkdir()
    # Of the user that fetches for apt-get.
    folder.chmod(0o755)
    as_root = ("-o", "APT::Sandbox::User=root")  # The folder is root's alone.
    _run("apt-get", "-qq", *as_root, "download", "mmdebstrap", "qemu-user-static", cwd=tools)
    for package in tools.glob("*.deb"):
        _run("dpkg", "--extract", package, tools)
    _run(
        *("perl", tools / "usr/bin/mmdebstrap", "--quiet", "--mode=root", "--architectures=arm64"),
        *("--variant=extract", f"--include={PACKAGES}", SUITE, root, MIRROR),
    )
    return root


def _run(*words: object, cwd: Path | None = None) -> None:
    subprocess.run(
        [str(word) for word in words], cwd=cwd, check=True, capture_output=True, text=True
    )


if __name__ == "__main__":
    sys.exit(main())
