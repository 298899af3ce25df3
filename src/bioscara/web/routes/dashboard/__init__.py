"""The routes whose answers :mod:`bioscara.dashboard` computes; each module serves its namesake.

Begin with ``work``: they are computed in threads of its own, so that no other request waits.
"""
