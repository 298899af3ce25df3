"""Standard output whose failure does not affect the arm."""

from __future__ import annotations

from bioscara.printing import printable


class Output:
    """Writes lines to standard output until that fails, and nothing from then on.

    Attributes:
        problem: The error that ended the output; None while it works.
    """

    def __init__(self) -> None:
        self.problem: OSError | None = None

    def line(self, text: str = "") -> None:
        """Write and flush one line; non-printable characters, also line ends, are escaped."""
        if self.problem is None:
            try:
                print(printable(text), flush=True)  # noqa: T201
            except OSError as error:
                self.fail(error)

    def fail(self, error: OSError) -> None:
        """End the output because of ``error``."""
        self.problem = error

    def check(self) -> None:
        """Raise the error of the output; to be called at the end, when it disturbs nothing.

        Raises:
            OSError: The error that ended the output; BrokenPipeError if the reader closed it.
        """
        if self.problem is not None:
            raise self.problem
