"""The controllers: goals and measured states go in, commands come out.

``controller`` is the interface of all; every other module is one controller with its parts. To
add one, implement ``controller.Controller`` and add it to ``TYPES`` in ``manager.registry``.
"""
