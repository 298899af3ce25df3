"""Sequences of steps: motions, gripper, waits; taught in the browser or written as YAML.

Begin with ``steps``: a ``StepSequence`` is a list of them. ``sequence_file`` reads and writes YAML,
``running`` carries a sequence out. ``dry_run`` plans without moving, and ``script`` writes the
sequence as a Python program.
"""
