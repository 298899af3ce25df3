"""Settings of the routes of a gateway."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bioscara.web.access.addresses import OwnAddresses
from bioscara.web.access.browser_sessions import BrowserSessions
from bioscara.web.access.tokens import Tokens


@dataclass(frozen=True, slots=True)
class WebSettings:
    """Values that the routes need.

    Attributes:
        arm: Name of the owner.
        own: Host names and origins of the gateway.
        tokens: The tokens.
        tls: Whether the gateway speaks TLS.
        sessions: The signed-in browsers.
        recordings: Folder of the recordings.
    """

    arm: str
    own: OwnAddresses
    tokens: Tokens
    tls: bool
    sessions: BrowserSessions
    recordings: Path = Path("recordings")

    @property
    def cookie(self) -> str:
        """Name of the cookie; gateways on other ports of a host share its cookies."""
        return f"__Host-bioscara-{self.arm}" if self.tls else f"bioscara-{self.arm}"
