"""The output of a command: messages, live display and recording of a motion, plots.

``console`` has standard output, error messages and the exit status. ``observer`` receives the
cycles of a motion in a separate thread, records them and passes them to a ``live_view``: the one
that ``display`` selects, plain lines or the table of ``live_table`` with rich. ``plots`` writes the
files of ``--csv`` and ``--plot``.
``angles`` writes positions and poses in radians or degrees. Nothing here may delay or stop a
motion.
"""
