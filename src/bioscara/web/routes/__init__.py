"""The routes of the gateway, one module for each group.

Each module has a function ``add(app, ...)``. ``http`` has their common parts: the scope that a
route needs, bodies, answers and refusals. ``page`` serves the files of the page, ``session`` signs
browsers in, ``questions`` asks the owner, ``arms`` all owners, ``websocket`` begins relays,
``openapi`` describes all routes. ``dashboard`` has the routes of the page whose answers are
no messages of the owner.
"""
