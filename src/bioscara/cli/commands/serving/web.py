"""``bioscara web``."""

from __future__ import annotations

import sys
from importlib.util import find_spec

from bioscara.cli.commands.serving.owners import owner_name
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.signals import StopRequest
from bioscara.errors import ConfigurationError
from bioscara.extras import install
from bioscara.server import log

_NEEDED = ("cryptography", "fastapi", "uvicorn", "websockets")


def require_packages() -> None:
    """Raise unless the packages of the gateway are installed.

    Raises:
        ConfigurationError: One is missing.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"the web gateway needs {', '.join(missing)}, not installed: {install('web')}"
        )


def run(options: Options) -> int:
    """Serve the gateway of an arm until Ctrl-C.

    Raises:
        ConfigurationError: A package is missing, or the gateway may not listen there.
        BioscaraError: No owner of that name runs, or its tokens cannot be used.
        OSError: Standard output cannot be written.
    """
    require_packages()
    # Imported here: installed by an extra.
    from bioscara.robot.tasks.scope import Scope  # noqa: PLC0415
    from bioscara.web.gateway import Gateway, GatewaySettings  # noqa: PLC0415

    output, arm = Output(), owner_name(options)
    settings = GatewaySettings(
        arm,
        options.host,
        options.port,
        options.allowed_host,
        options.token_file,
        options.tls_cert,
        options.tls_key,
        options.tls_self_signed,
        options.recordings,
    )
    log.set_up(as_json=False)
    with StopRequest() as cancelled:
        gateway = Gateway(settings)
        scopes = [each for each in Scope if options.show in {None, each.name.lower()}]
        if not sys.stdout.isatty():
            # Of a service this is its log, which others may read.
            scopes = []
        # Where one address with a token is shown, another one beside it would be opened in vain.
        address = gateway.url_with_token(scopes[0]) if len(scopes) == 1 else gateway.url
        output.line(f"arm {arm} on the web: {address} (Ctrl-C ends it)")
        if not scopes:
            output.line(f"its tokens are in {gateway.token_file}: open the address with #token=...")
        elif len(scopes) > 1:
            for scope in scopes:
                output.line(f"  to {scope.name.lower():8}{gateway.url_with_token(scope)}")
        if gateway.fingerprint:
            output.line(f"SHA-256 fingerprint of its certificate: {gateway.fingerprint}")
        gateway.run(cancelled)
    output.check()
    return ExitStatus.OK
