"""Count the idioms of idioms.txt in the project's prose, per 10,000 words."""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIMIT = 5.0
"""Idioms in 10,000 words of a folder. One is allowed in a folder of any size."""
FOLDERS = (
    ".",
    "src",
    "firmware",
    "docs",
    "tests",
    "ros",
    "interfaces",
    "tools",
    "examples",
    "benchmarks",
)
"""Folders with prose; ``.`` is the documents at the top."""
_NOT_OURS = {"build", "node_modules", "vendor", "uplot"}
_SUFFIXES = {".py", ".cpp", ".h", ".js", ".mjs", ".md"}
_C_COMMENT = re.compile(r"//([^\n]*)|/\*(.*?)\*/", re.DOTALL)
_FENCED = re.compile(r"```.*?```|`[^`\n]*`|^ {4}[^\n]*$", re.DOTALL | re.MULTILINE)


def idioms() -> re.Pattern[str]:
    """Return the word list as one expression."""
    lines = (ROOT / "tools/idioms.txt").read_text().splitlines()
    return re.compile("|".join(f"(?:{line})" for line in lines if line and line[0] != "#"), re.I)


def python_prose(source: str) -> Iterator[str]:
    """Yield the docstrings and comments of a Python module."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield text
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.string


def prose(path: Path) -> str:
    """Return the prose of a file: docstrings, comments, text of documents and of the page."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return "\n".join(python_prose(text))
    if path.suffix in {".cpp", ".h", ".js", ".mjs"} and path.name != "texts.js":
        return "\n".join(a or b for a, b in _C_COMMENT.findall(text))
    return _FENCED.sub(" ", text)


def main() -> int:
    """Print the count of each folder; ``-v`` prints the places. Return 1 above a limit."""
    pattern, verbose, failed = idioms(), "-v" in sys.argv, False
    chosen = [word for word in sys.argv[1:] if not word.startswith("-")] or FOLDERS
    for folder in chosen:
        words = found = 0
        for path in sorted((ROOT / folder).glob("*" if folder == "." else "**/*")):
            if path.suffix not in _SUFFIXES or _NOT_OURS & set(path.parts):
                continue
            text = prose(path)
            words += len(re.findall(r"[A-Za-z]+", text))
            hits = list(pattern.finditer(text))
            found += len(hits)
            for hit in hits if verbose else ():
                start, end = max(hit.start() - 40, 0), hit.end() + 40
                place = " ".join(text[start:end].split())
                print(f"{path.relative_to(ROOT)}: {hit.group()!r}: {place}")  # noqa: T201
        rate = 1e4 * found / max(words, 1)
        failed |= found > 1 and rate > LIMIT
        print(f"{folder}: {found} idioms in {words} words, {rate:.0f} per 10,000")  # noqa: T201
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
