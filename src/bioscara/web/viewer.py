"""The page of ``bioscara view``: it shows a file or an observed arm, without an owner."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import FastAPI, Query, Request, Response

from bioscara.dashboard.clearance import clearance
from bioscara.dashboard.viewed import Viewed, ViewedNow
from bioscara.errors import BusUnavailableError
from bioscara.model import ArmParameters
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.addresses import LOCAL_NAMES, OwnAddresses
from bioscara.web.access.browser_sessions import BrowserSessions
from bioscara.web.access.guard import SIGN_IN_PERIOD, SIGN_INS
from bioscara.web.access.rate_limit import RateLimits
from bioscara.web.access.tokens import view_token
from bioscara.web.app import guarded
from bioscara.web.gateway import LOOPBACK, PageServer, listening
from bioscara.web.routes import http, page, session
from bioscara.web.routes.dashboard import model
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import Viewer, json
from bioscara.web.settings import WebSettings

Look = Callable[[], tuple[float, Sequence[float]]]
"""Returns an arm's time [s] and the positions of j1 to j4 [rad, m, rad, rad]; raises
BusUnavailableError while there is no arm."""


class ViewServer(PageServer):
    """Serves the page to browsers of this computer; it has nothing that moves an arm.

    Args:
        port: TCP port; 0 for a free one.
        viewed: The content of the page.
        look: Observes the arm, if it moves now.

    Attributes:
        url: Address of the page, with a token that no file has.

    Raises:
        ConfigurationError: The port cannot be listened on.
    """

    def __init__(self, port: int, viewed: Viewed, look: Look | None = None) -> None:
        listener = listening(LOOPBACK, port)
        port = listener.getsockname()[1]
        own, tokens = OwnAddresses(LOCAL_NAMES, port, tls=False), view_token()
        # Browsers send cookies to all ports of a host: another view has another name.
        settings = WebSettings(f"view-{port}", own, tokens, False, BrowserSessions())
        super().__init__(listener, guarded(make_app(settings, viewed, look), settings))
        self.url = f"http://{LOOPBACK}:{port}/viewer.html#token={tokens.of(Scope.VIEW)}"


def make_app(settings: WebSettings, viewed: Viewed, look: Look | None) -> FastAPI:
    """Return the routes; they must only be served through :func:`~bioscara.web.app.guarded`."""
    work, looking = Work(), asyncio.Lock()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        await work.close()

    async def parameters() -> ArmParameters:
        return viewed.parameters

    app = FastAPI(
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        default_response_class=Response,
        lifespan=lifespan,
    )
    app.state.sign_ins = RateLimits(SIGN_INS, SIGN_INS / SIGN_IN_PERIOD)
    http.add_refusals(app)
    page.add_files(app)
    session.add(app, settings)
    model.add(app, parameters, work)

    @app.get("/api/viewed")
    def what(_: Viewer) -> Response:
        return json(viewed)

    @app.get("/api/viewed/now")
    async def now(_: Viewer) -> Response:
        # One at a time: an observer has one connection.
        async with looking:
            return json(await asyncio.to_thread(_seen, look))

    @app.get("/api/clearance")
    async def nearest(
        joints: Annotated[list[float], Query()], request: Request, _: Viewer
    ) -> Response:
        return json(await work.do(request, clearance, viewed.parameters, viewed.workspace, joints))

    return app


def _seen(look: Look | None) -> ViewedNow:
    if look is None:
        return ViewedNow(0.0, (), "nothing moves here")
    try:
        return ViewedNow(*look())
    except BusUnavailableError as error:
        return ViewedNow(0.0, (), str(error))
