"""The most stack that an image can need, from its machine code, and whether it is reserved.

``stack.py j1.elf`` adds up the deepest chain of calls of the program, of the control tick and of
the I2C interrupt, which can interrupt each other in this order, and two exception frames. What a
function pushes counts as if all of it were pushed at once, so the sum is an upper bound. A call
through a pointer is one of the board's virtual functions or a constructor. Fails above what the
linker script reserves, for recursion and for a stack that grows by a computed amount. Standard
library only.
"""

from __future__ import annotations

import re
import subprocess
import sys

ENTRIES = {"program": "reset_handler", "tick": "control_tick_handler", "I2C": "i2c_handler"}
"""Entry points by name; each can be interrupted by the ones after it."""

EXCEPTION_FRAME = 4 * (8 + 18) + 4
"""Bytes that the processor pushes: eight registers, those of the FPU, and alignment."""

BY_POINTER = re.compile(r"^bioscara::Board::|^_GLOBAL__sub_I_")
"""Functions that a call through a pointer can reach."""

_FUNCTION = re.compile(r"^([0-9a-f]{8}) <(.+)>:$")
_INSTRUCTION = re.compile(r"^ *[0-9a-f]+:\t[0-9a-f ]+\t(\S+)(?:\t(.*))?$")
_TARGET = re.compile(r"^(?:\w+, )?[0-9a-f]+ <(.+?)(\+0x[0-9a-f]+)?>")
_BRANCH = re.compile(r"(?:b|bl|cbn?z)(?:eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?(?:\.[nw])?$")
_PREDECREMENT = re.compile(r"\[sp, #-(\d+)\]!")


class Function:
    """Stack [bytes] that one function pushes, and its calls; ``None`` among them is a pointer."""

    def __init__(self) -> None:
        self.pushed = 0
        self.calls: set[str | None] = set()


def _registers(operands: str) -> int:
    """Return how many registers a list such as ``{r4, r5, lr}`` or ``{d8-d10}`` names."""
    count = 0
    for item in operands[operands.index("{") + 1 : operands.index("}")].split(","):
        first, _, last = item.strip().partition("-")
        count += int(last[1:]) - int(first[1:]) + 1 if last else 1
    return count


def _pushed(name: str, operation: str, operands: str) -> int:
    """Return the bytes by which one instruction moves the stack pointer down."""
    operation = operation.removesuffix(".w")
    if operation == "push" or (operation == "stmdb" and operands.startswith("sp!")):
        return 4 * _registers(operands)
    if operation == "vpush" or (operation == "vstmdb" and operands.startswith("sp!")):
        return (8 if "d" in operands else 4) * _registers(operands)
    if operation in ("sub", "subw") and operands.startswith("sp,"):
        immediate = re.search(r"#(\d+)", operands)
        if immediate is None:
            raise ValueError(f"{name} takes a computed amount of stack")
        return int(immediate[1])
    predecrement = _PREDECREMENT.search(operands)
    return int(predecrement[1]) if predecrement else 0


def parse(disassembly: str) -> dict[str, Function]:
    """Return the functions of the output of ``objdump -d --demangle``.

    Raises:
        ValueError: A function takes a computed amount of stack.
    """
    functions: dict[str, Function] = {}
    name, function = "", Function()
    for line in disassembly.splitlines():
        if header := _FUNCTION.match(line):
            name = header[2]
            function = functions.setdefault(name, Function())
        elif instruction := _INSTRUCTION.match(line):
            operation, operands = instruction[1], instruction[2] or ""
            function.pushed += _pushed(name, operation, operands)
            if operation in ("blx", "bx") and not operands.startswith("lr"):
                function.calls.add(None)
            elif (
                _BRANCH.match(operation)
                and (target := _TARGET.match(operands))
                and target[1] != name
            ):
                function.calls.add(target[1])
    return functions


def deepest(functions: dict[str, Function], entry: str, above: tuple[str, ...] = ()) -> int:
    """Return the most stack [bytes] of ``entry`` and all that it calls.

    Raises:
        ValueError: The function can call itself, or calls one that is not in the image.
    """
    if entry in above:
        raise ValueError(f"{entry} can call itself: " + " > ".join((*above, entry)))
    if entry not in functions:
        raise ValueError(f"{entry} is called and not in the image")
    function = functions[entry]
    called: set[str] = set()
    for name in function.calls:
        called |= {name} if name else {each for each in functions if BY_POINTER.match(each)}
    chain = (*above, entry)
    return function.pushed + max((deepest(functions, name, chain) for name in called), default=0)


def _tool(name: str, *arguments: str) -> str:
    return subprocess.run(  # noqa: S603
        [f"arm-none-eabi-{name}", *arguments], check=True, capture_output=True, text=True
    ).stdout


def main(path: str) -> int:
    """Print the sum for the image at ``path``; return 1 if it is not bounded or too much."""
    lines = (line.split() for line in _tool("nm", path).splitlines())
    symbols = {fields[-1]: int(fields[0], 16) for fields in lines}
    reserved = symbols["stack_top"] - symbols["stack_bottom"]
    try:
        functions = parse(_tool("objdump", "-d", "--demangle", path))
        depths = {name: deepest(functions, entry) for name, entry in ENTRIES.items()}
    except ValueError as error:
        sys.stderr.write(f"{path}: the stack is not bounded: {error}\n")
        return 1
    frames = EXCEPTION_FRAME * (len(ENTRIES) - 1)
    total = sum(depths.values()) + frames
    parts = ", ".join(f"{name} {depth}" for name, depth in depths.items())
    sys.stdout.write(f"stack: {parts}, exception frames {frames}: {total} of {reserved} bytes\n")
    if total > reserved:
        sys.stderr.write(
            f"{path}: needs {total} bytes of stack, the linker script has {reserved}\n"
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
