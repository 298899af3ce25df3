"""Motion of one joint: pieces of constant jerk.

``double_s`` computes the fastest motion between two states within limits, ``extremal`` the largest
displacement of a joint in a given time.
"""
