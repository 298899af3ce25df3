"""Build Python packages of ROS 2 interfaces from definition files, without CMake and ament.

    python generate.py OUT              # all packages of definitions/ into OUT
    python generate.py OUT tf2_msgs     # one of them

The code generators and libraries are those of the ROS wheels, in the running environment. Each
package gets its Python modules, three libraries and an extension module:

    PKG/libPKG__rosidl_generator_c.so                  messages in C, their hashes, type supports
    PKG/libPKG__rosidl_typesupport_fastrtps_c.so       messages as bytes
    PKG/libPKG__rosidl_typesupport_introspection_c.so  fields of messages, for Fast DDS
    PKG/PKG_s__rosidl_typesupport_c.*.so               Python objects to messages in C and back
"""

from __future__ import annotations

import functools
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

DEFINITIONS = Path(__file__).parent / "definitions"
PACKAGES = (  # the longest build first
    "control_msgs",
    "bioscara_interfaces",
    "controller_manager_msgs",
    "pal_statistics_msgs",
    "tf2_msgs",
)
COMPILE = ("-fPIC", "-O1", "-g0", "-w", "-DNDEBUG", "-DROS_PACKAGE_NAME=bioscara")
# Found in the library's folder, then in the environment's lib folder, from where the wheel puts
# it. The old kind of path, searched before LD_LIBRARY_PATH: no library of another ROS is taken.
RPATH = "-Wl,--disable-new-dtags,-rpath,$ORIGIN:$ORIGIN/../../../.."
WHOLE = "-Wl,-z,defs"  # refuse a library that needs what no other one has
LIBRARIES = (
    "rosidl_typesupport_fastrtps_cpp",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_introspection_c",
    "rosidl_typesupport_c",
    "rosidl_runtime_c",
    "rcutils",
    "rmw",
    "fastcdr",
)
KINDS = (
    "rosidl_generator_c",
    "rosidl_generator_py",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_introspection_c",
)


class BuildError(Exception):
    """The packages cannot be built here."""


def ros_prefix() -> Path:
    """Return the folder above ``lib``, ``include`` and ``share`` of the ROS wheels.

    Raises:
        BuildError: They are not installed in the running environment.
    """
    found = importlib.util.find_spec("rosidl_parser")
    if found is None or found.origin is None:
        raise BuildError(
            "the ROS wheels are not installed in this environment: "
            "pip install ros-rclpy==9.1.2 ros-sensor-msgs ros-trajectory-msgs "
            "ros-diagnostic-msgs ros-rmw-fastrtps-cpp"
        )
    return Path(found.origin).parents[4]


def refuse_beside_ros(environ: Mapping[str, str]) -> None:
    """Refuse to build where a ROS installation is active: its own packages are the ones to use.

    Args:
        environ: The environment; ``AMENT_PREFIX_PATH`` has the folders of active installations.

    Raises:
        BuildError: One of them has rclpy or one of our packages.
    """
    for prefix in filter(None, environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        index = Path(prefix) / "share" / "ament_index" / "resource_index" / "packages"
        for package in ("rclpy", *PACKAGES):
            if (index / package).exists():
                raise BuildError(
                    f"{prefix} is a ROS installation with {package}, and must not be mixed with "
                    "the ROS wheels: install ros-$ROS_DISTRO-control-msgs, "
                    "ros-$ROS_DISTRO-controller-manager-msgs and "
                    "ros-$ROS_DISTRO-pal-statistics-msgs with apt and build "
                    "bioscara_interfaces with colcon, or unset AMENT_PREFIX_PATH"
                )


def clean_environment() -> dict[str, str]:
    """Return the environment for programs that are not this Python.

    The ROS wheels put their libraries into LD_LIBRARY_PATH of every process that Python starts.
    """
    ours = {"LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    return {name: value for name, value in os.environ.items() if name not in ours}


def build_all(out: Path) -> None:
    """Build all packages, each in a process of its own.

    Args:
        out: Folder for them, one each.

    Raises:
        BuildError: One could not be built, or a ROS installation is active.
    """
    refuse_beside_ros(os.environ)
    ros_prefix()
    if shutil.which("g++") is None:
        raise BuildError("g++ is missing: on Debian and Ubuntu, apt install g++")
    running = {
        package: subprocess.Popen(
            [sys.executable, __file__, str(out), package],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        for package in PACKAGES
    }
    errors = {package: process.communicate()[1] for package, process in running.items()}
    for package, process in running.items():
        if process.returncode:
            raise BuildError(f"{package} was not built:\n{errors[package]}")


def build(package: str, out: Path) -> None:
    """Build one package.

    Args:
        package: Its name, a folder of ``definitions``.
        out: Folder that it is put into.
    """
    target = out / package
    shutil.rmtree(target, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=f"{package}-") as folder:
        sources = _generate(package, Path(folder), target)
        _compile(package, Path(folder), target, sources)
    for file in (*target.rglob("*_s.c"), *target.glob("*.c")):
        file.unlink()


def _parse_once() -> None:
    """Let each definition be parsed once, not once by each generator."""
    import rosidl_generator_py.generate_py_impl
    import rosidl_generator_type_description
    import rosidl_parser.parser
    import rosidl_pycommon

    parse = rosidl_parser.parser.parse_idl_file
    parsed: dict[str, object] = {}

    @functools.wraps(parse)
    def once(locator: Any) -> object:
        path = str(locator.get_absolute_path())
        if path not in parsed:
            parsed[path] = parse(locator)
        return parsed[path]

    for module in (
        rosidl_parser.parser,
        rosidl_pycommon,
        rosidl_generator_type_description,
        rosidl_generator_py.generate_py_impl,
    ):
        module.parse_idl_file = once


def _scan_once() -> None:
    """Let the engine of the templates look for the end of an expression once for each text.

    It scans them by character, again for each message and each turn of a loop, which is most of the
    time that generating takes.
    """
    from em import Scanner

    ends: dict[tuple[object, ...], int] = {}
    complex_, next_ = Scanner.complex, Scanner.next

    def find(scanner: Scanner, start: int, end: int | None, key: object, scan: Callable) -> int:
        rest = scanner.buffer[scanner.head + scanner.pointer + start :]
        length = None if end is None else end - start
        place = (rest, length, key)
        if place not in ends:
            ends[place] = scan() - start
        return start + ends[place]

    def complex_once(self, enter, exit_, comment="#", start=0, end=None, skip=None):
        def scan() -> int:
            return complex_(self, enter, exit_, comment, start, end, skip)

        return find(self, start, end, (enter, exit_, comment, skip), scan)

    def next_once(self, target, start=0, end=None, mandatory=False):
        def scan() -> int:
            return next_(self, target, start, end, mandatory)

        return find(self, start, end, (target, mandatory), scan)

    Scanner.complex, Scanner.next = complex_once, next_once


def _generate(package: str, work: Path, target: Path) -> dict[str, list[Path]]:
    """Write C and Python of a package; return the C files by the library that they are for."""
    from rosidl_adapter import convert_to_idl
    from rosidl_generator_c import generate_c
    from rosidl_generator_py import generate_py
    from rosidl_generator_type_description import generate_type_hash
    from rosidl_typesupport_c import generate_c as generate_dispatch
    from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c
    from rosidl_typesupport_introspection_c import generate_c as generate_introspection

    _parse_once()
    _scan_once()
    share = ros_prefix() / "share"
    definitions = DEFINITIONS / package
    names = sorted(path.relative_to(definitions) for path in definitions.glob("*/*.*"))
    idls = [name.with_suffix(".idl") for name in names]
    for name in names:
        convert_to_idl(definitions, package, name, work / "idl")
    for kind in {name.parent for name in names}:
        (target / kind).mkdir(parents=True)
    (target / "__init__.py").write_text("")

    def run(generator: Callable[[str], object], kind: str, output: Path) -> None:
        arguments = {
            "package_name": package,
            "idl_tuples": [f"{work / 'idl'}:{idl}" for idl in idls],
            "output_dir": str(output),
            "template_dir": str(share / kind / "resource"),
            "target_dependencies": [],
            "ros_interface_files": [str(definitions / name) for name in names],
            "include_paths": [f"{path.name}:{path}" for path in share.iterdir()],
        }
        if kind == "rosidl_generator_c":
            hashes = [f"{idl}:{work / 'hash' / idl.with_suffix('.json')}" for idl in idls]
            arguments["type_description_tuples"] = hashes
        file = work / f"{kind}.json"
        file.write_text(json.dumps(arguments))
        generator(str(file))

    c = work / "include" / package / package
    run(generate_type_hash, "rosidl_generator_type_description", work / "hash")
    run(generate_c, "rosidl_generator_c", c)
    run(generate_typesupport_fastrtps_c, "rosidl_typesupport_fastrtps_c", c)
    # In a folder of its own: some of its files have names of those before.
    introspection = work / "introspection" / package / package
    run(generate_introspection, "rosidl_typesupport_introspection_c", introspection)
    supports = ["rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"]
    run(lambda file: generate_dispatch(file, supports), "rosidl_typesupport_c", work / "dispatch")
    run(lambda file: generate_py(file, ["rosidl_typesupport_c"]), "rosidl_generator_py", target)
    for kind in KINDS:
        for template in (share / kind / "resource").glob("*__visibility_control.h.in"):
            text = template.read_text().replace("@PROJECT_NAME@", package)
            text = text.replace("@PROJECT_NAME_UPPER@", package.upper())
            (c / "msg").mkdir(exist_ok=True)
            (c / "msg" / template.stem).write_text(text)
    return {
        "description": sorted(c.rglob("*__description.c")),
        "generator": sorted(set(c.rglob("*.c")) - set(c.rglob("*__description.c"))),
        "dispatch": sorted((work / "dispatch").rglob("*.cpp")),
        "fastrtps": sorted(c.rglob("*__type_support_c.cpp")),
        "introspection": sorted(introspection.rglob("*.c")),
        "python": sorted((*target.rglob("*_s.c"), *target.glob("*.c"))),
    }


def _compile(package: str, work: Path, target: Path, sources: dict[str, list[Path]]) -> None:
    """Compile and link the libraries and the extension module of a package."""
    import numpy

    prefix = ros_prefix()
    headers = [
        prefix / "include",
        *(path for path in (prefix / "include").iterdir() if not path.name.startswith("python")),
        work / "include" / package,
        work / "introspection" / package,
        sysconfig.get_path("include"),
        numpy.get_include(),
    ]
    include = [f"-I{path}" for path in headers]

    def run(*command: str | Path) -> None:
        done = subprocess.run(
            [str(part) for part in command],
            check=False,
            capture_output=True,
            text=True,
            env=clean_environment(),
        )
        if done.returncode:
            raise BuildError(f"{' '.join(map(str, command))}\n{done.stderr}")

    def object_of(name: str, files: list[Path]) -> Path:
        """Compile files as one, which takes a fraction of the time."""
        language = files[0].suffix
        source = work / f"{name}{language}"
        source.write_text("".join(f'#include "{file}"\n' for file in files))
        compiled = source.with_suffix(".o")
        run(
            "g++" if language == ".cpp" else "gcc", *COMPILE, *include, "-c", source, "-o", compiled
        )
        return compiled

    def link(name: str, objects: list[Path], libraries: list[str], *flags: str) -> None:
        run(
            "g++", "-shared", *flags, *objects, "-o", target / name, f"-Wl,-soname,{name}", RPATH,
            f"-L{target}", f"-L{prefix / 'lib'}",
            "-Wl,--no-as-needed", *(f"-l{library}" for library in libraries),
            "-Wl,--as-needed", *(f"-l{library}" for library in (*used, *LIBRARIES)),
        )  # fmt: skip

    # The same file-static names are in each description: these are compiled one by one.
    described = [object_of(f"d{i}", [file]) for i, file in enumerate(sources["description"])]
    generator = object_of("generator", sources["generator"])
    dispatch = object_of("dispatch", sources["dispatch"])
    own = f"{package}__rosidl_generator_c"
    used = [
        f"{path.name}__{kind}"
        for path in (prefix / "share").iterdir()
        for kind in (*KINDS, "rosidl_typesupport_c")
        if (prefix / "lib" / f"lib{path.name}__{kind}.so").exists()
    ]
    link(f"lib{own}.so", [*described, generator, dispatch], [], WHOLE)
    supports = []
    for kind in ("fastrtps", "introspection"):
        supports.append(f"{package}__rosidl_typesupport_{kind}_c")
        link(f"lib{supports[-1]}.so", [object_of(kind, sources[kind])], [own], WHOLE)
    # Linked to both type supports, which are opened by name later: then they are loaded already.
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    link(
        f"{package}_s__rosidl_typesupport_c{suffix}",
        [object_of("python", sources["python"])],
        [*supports, own],
    )


def main() -> None:
    """Build the packages that the command line names."""
    out = Path(sys.argv[1]).resolve()
    try:
        if len(sys.argv) > 2:
            build(sys.argv[2], out)
        else:
            build_all(out)
    except BuildError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
