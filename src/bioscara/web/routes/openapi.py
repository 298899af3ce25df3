"""The description of all routes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
from fastapi import FastAPI, Response

from bioscara.api import messages as m
from bioscara.web.routes.http import JSON, Viewer


def add(app: FastAPI, types: Sequence[type[Any]]) -> None:
    """Add the route.

    Args:
        app: The routes, all of which are there already.
        types: Types of answers and bodies.
    """
    cached: list[bytes] = []

    @app.get("/openapi.json", include_in_schema=False)
    def openapi(_: Viewer) -> Response:
        if not cached:
            cached.append(msgspec.json.encode(_document(app, types)))
        return Response(cached[0], media_type=JSON)


def _document(app: FastAPI, given: Sequence[type[Any]]) -> dict[str, Any]:
    """Return the OpenAPI document, with the messages of the WebSocket among its schemas."""
    template = "#/components/schemas/{name}"
    types = [m.FromClient, m.FromOwner, *given]
    (sent, received, *_), schemas = msgspec.json.schema_components(types, ref_template=template)
    _, sendable = msgspec.json.schema_components([m.FromClient], ref_template=template)
    # Messages that only the owner sends may have unknown numbers; from a client they are refused.
    schemas = {
        name: schema if name in sendable else _with_unknown_numbers(schema)
        for name, schema in schemas.items()
    }
    document: dict[str, Any] = dict(app.openapi())
    components = document.setdefault("components", {})
    components.setdefault("schemas", {}).update(schemas, FromClient=sent, FromOwner=received)
    components["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
    document["security"] = [{"token": []}]
    document["info"]["description"] = (
        "The WebSocket /ws takes FromClient and sends FromOwner, each as a text message."
    )
    return document


def _with_unknown_numbers(schema: Any) -> Any:
    """Return a schema in which a number may be null."""
    match schema:
        case {"type": "number"}:
            return {**schema, "type": ["number", "null"]}
        case dict():
            return {key: _with_unknown_numbers(value) for key, value in schema.items()}
        case list():
            return [_with_unknown_numbers(value) for value in schema]
    return schema
