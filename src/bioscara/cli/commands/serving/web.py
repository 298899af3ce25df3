"""``bioscara web``."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import RECORDINGS, share
from bioscara.errors import ConfigurationError
from bioscara.extras import install

_NEEDED = ("cryptography", "fastapi", "uvicorn", "websockets")


def arguments(parser: Parser) -> None:
    share(parser, "--arm")
    parser.add_argument(
        "--host",
        metavar="ADDRESS",
        default="127.0.0.1",
        help="address to listen on (default: 127.0.0.1, for this computer only); another one needs "
        "TLS",
    )
    share(parser, "--port", help="TCP port to listen on (default 8080); 0 for a free one")
    parser.add_argument(
        "--allowed-host",
        metavar="NAME",
        action="append",
        default=[],
        help="a further name by which browsers call this computer; may be given several times",
    )
    parser.add_argument("--tls-cert", metavar="FILE", type=Path, help="certificate for TLS, as PEM")
    parser.add_argument("--tls-key", metavar="FILE", type=Path, help="its key, as PEM")
    parser.add_argument(
        "--tls-self-signed",
        action="store_true",
        help="make a certificate for TLS; the browser asks whether to trust it",
    )
    parser.add_argument(
        "--token-file",
        metavar="FILE",
        type=Path,
        help="file with the tokens, made if it does not exist (default: beside the owner's socket)",
    )
    parser.add_argument(
        "--recordings",
        metavar="DIR",
        type=Path,
        default=RECORDINGS,
        help="folder of the recordings that browsers may load (default recordings)",
    )
    parser.add_argument(
        "--show",
        metavar="SCOPE",
        choices=("view", "operate", "admin"),
        help="print only the address with the token of this scope (default: all three)",
    )
    parser.checks.append(_check_tls)


def _check_tls(parser: Parser, options: Options) -> None:
    """Refuse options of ``web`` that exclude or need one another."""
    certificate, key = options.tls_cert is not None, options.tls_key is not None
    if certificate != key:
        given, other = ("--tls-cert", "--tls-key") if certificate else ("--tls-key", "--tls-cert")
        parser.error(f"{given} needs {other} with the other half; give both")
    if certificate and options.tls_self_signed:
        parser.error("--tls-cert and --tls-self-signed exclude one another; leave out one of them")


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


def run(options: Options, output: Output) -> None:
    """Serve the gateway of an arm until Ctrl-C.

    Raises:
        ConfigurationError: A package is missing, or the gateway may not listen there.
        BioscaraError: No owner of that name runs, or its tokens cannot be used.
    """
    require_packages()
    from bioscara.cli.owner_link import owner_name
    from bioscara.cli.signals import StopRequest
    from bioscara.processes.nursery import start_early
    from bioscara.processes.unread_output import never_wait
    from bioscara.robot.tasks.scope import Scope
    from bioscara.server import log
    from bioscara.web.gateway import Gateway, GatewaySettings
    from bioscara.web.routes.dashboard.work import MODULES

    # First: nothing is open yet, and no thread runs.
    never_wait(lambda: start_early(MODULES, fork=True))
    arm = owner_name(options)
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
        # Where one address with a token is shown, another one next to it would be opened in vain.
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
