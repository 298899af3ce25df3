"""The routes of the gateway, one module for each group.

Each module has a function ``add(app, ...)``. ``http`` has their common parts: the scope that a
route needs, bodies, answers and refusals. ``page`` serves the files of the page, ``session`` signs
browsers in, ``questions`` asks the owner, ``websocket`` begins relays, ``openapi`` describes them
all. Answers to the page that are no messages of the owner are computed by
:mod:`bioscara.dashboard`, in the threads of ``work``, and served by the others.
"""
