"""Uses of recordings: they are listed, completed, exported, shown and replayed.

Begin with ``scan``, which reads a file, also one that its writer never finished. On it build
``contents``, ``recovery`` and ``sample_table``, its samples as columns of numbers; on these
``export``, which also has ``flight_records`` unpacked, ``joint_motion`` for the viewer, and
``replay``. ``json_messages`` decodes messages recorded as JSON.
"""
