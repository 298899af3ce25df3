"""The output of a command: messages, live display and recording of a motion, plots.

``console`` has standard output, error messages and the exit status. ``observer`` receives the
cycles of a motion in a separate thread, records them and passes them to the display that
``live_view`` selects, with rich from ``live_table``. ``plots`` writes the files of ``--csv`` and
``--plot``, ``firmware`` names a joint's versions.
``angles`` writes positions and poses in radians or degrees. Nothing here may delay or stop a
motion.
"""
