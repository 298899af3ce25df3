"""Standard output that may go away without the arm noticing."""

from __future__ import annotations

from bioscara.printing import printable


class Output:
    """Writes lines to standard output until it fails; then it stays silent.

    Attributes:
        problem: Why it fell silent; None while it works.
    """

    def __init__(self) -> None:
        self.problem: OSError | None = None

    def line(self, text: str = "") -> None:
        """Write one line at once; what is not printable in it is escaped, also line ends."""
        if self.problem is None:
            try:
                print(printable(text), flush=True)  # noqa: T201
            except OSError as error:
                self.fail(error)

    def fail(self, error: OSError) -> None:
        """Fall silent because of ``error``."""
        self.problem = error

    def check(self) -> None:
        """Tell what went wrong, once there is nothing left that could be disturbed.

        Raises:
            OSError: What made it fall silent; BrokenPipeError when the reader went away.
        """
        if self.problem is not None:
            raise self.problem
