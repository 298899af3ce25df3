"""The routes of the gateway, joined."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI, Response
from starlette.types import ASGIApp

from bioscara.api import messages as m
from bioscara.dashboard.clearance import Clearance
from bioscara.dashboard.model import ArmModel
from bioscara.dashboard.parameters import ParameterChanges, ParameterDraft, ParameterTable
from bioscara.dashboard.recordings import RecordedSamples, RecordingEntry
from bioscara.dashboard.sequences import DryRun, SequenceText
from bioscara.dashboard.trajectories import CheckedTrajectory
from bioscara.version import __version__
from bioscara.web.access.guard import SIGN_IN_PERIOD, SIGN_INS, Guard
from bioscara.web.access.rate_limit import RateLimits
from bioscara.web.owner.facts import OwnerFacts
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.owner.served_arms import ServedArm, ServedArms, StoppedArm
from bioscara.web.routes import arms, http, openapi, page, questions, session, websocket
from bioscara.web.routes.dashboard import (
    clearance,
    model,
    parameters,
    recordings,
    sequences,
    trajectories,
)
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import Arriving
from bioscara.web.settings import WebSettings

PUBLIC = frozenset({*page.ASSETS, "/healthz", "/session"})
"""Paths that need no credential: they reveal nothing of the arm."""
_TYPES: tuple[type[Any], ...] = (
    session.SignIn,
    ArmModel,
    CheckedTrajectory,
    Clearance,
    ParameterChanges,
    ParameterDraft,
    ParameterTable,
    RecordedSamples,
    RecordingEntry,
    ServedArm,
    StoppedArm,
    DryRun,
    SequenceText,
    m.FailureValue,
    *(result for _, result, _ in questions.QUESTIONS.values()),
)
"""Types of the answers and bodies, for the OpenAPI document."""


def guarded(app: FastAPI, settings: WebSettings) -> ASGIApp:
    """Return the routes behind the check of each request."""
    return Guard(
        app,
        settings.own,
        settings.tokens,
        settings.sessions,
        app.state.sign_ins,
        settings.cookie,
        PUBLIC,
        frozenset(page.ASSETS),
    )


def make_app(settings: WebSettings) -> FastAPI:
    """Return the routes of a gateway; they must only be served through :func:`guarded`."""
    queries, work = OwnerQueries(settings.arm, "web gateway"), Work()
    facts, served = OwnerFacts(queries), ServedArms(settings.arm)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        work.start()
        yield
        await work.close()
        await served.close()
        await queries.close()

    app = FastAPI(
        title="Bioscara",
        version=__version__,
        openapi_url=None,  # its own route, as the built-in one has no check
        docs_url=None,  # FastAPI's pages load programs from other sites
        redoc_url=None,
        default_response_class=Response,  # each route encodes its answer
        lifespan=lifespan,
    )
    app.state.sign_ins = RateLimits(SIGN_INS, SIGN_INS / SIGN_IN_PERIOD)
    app.state.arriving = Arriving()
    http.add_refusals(app)
    page.add(app, settings.arm)
    session.add(app, settings)
    questions.add(app, settings, queries)
    model.add(app, facts.parameters, work)
    trajectories.add(app, facts, queries, work)
    clearance.add(app, facts, queries, work)
    parameters.add(app, queries, work)
    recordings.add(app, settings, work)
    arms.add(app, served)
    sequences.add(app, facts, queries, work)
    websocket.add(app, settings)
    openapi.add(app, _TYPES)
    return app
