"""Motion of one joint: pieces of constant jerk.

Two states and limits go in, the fastest motion between them comes out of ``double_s``.
``extremal`` gives the farthest a joint can get in a given time.
"""
