"""The controller manager: which controllers are loaded and active, and the control cycle.

Begin with ``manager``. A switch request is resolved in ``switch_request`` and carried out by
``switching``; ``claims`` knows which controller owns which command interface, ``registry``
which types of controllers exist and which of them are loaded.
"""
