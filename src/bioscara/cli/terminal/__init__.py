"""An arm at the terminal: moved by keys, and shown live.

Begin with ``keyboard``, which reads keys as they are pressed. ``jog_keys`` turns them into
velocities or steps for ``bioscara jog``. ``live_state`` shows the joints of an arm that no command
moves.
"""
