"""Whether the packages of the extras are installed, which recordings need."""

from __future__ import annotations

from importlib.util import find_spec

from bioscara.errors import ConfigurationError
from bioscara.extras import Extra, install

_MODULES: dict[Extra, tuple[str, ...]] = {
    "record": ("mcap", "mcap_ros2", "zstandard"),
    "export": ("pyarrow",),
}


def require_installed(extra: Extra) -> None:
    """Refuse to go on without the packages of an extra.

    Raises:
        ConfigurationError: One is missing; the message has the command that installs it.
    """
    missing = [name for name in _MODULES[extra] if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"recordings need {', '.join(missing)}, not installed here: {install(extra)}"
        )
