"""Whole runs of an arm by ``run`` and ``demo``: prepared, opened, shown live, and reported.

In go parsed options and a file; out come an exit status and the folder of the run. ``job`` runs a
trajectory or ``carry``, the plate of the demonstration; ``sequence`` runs steps, and ``watch``
shows the demonstration in the browser.
"""
