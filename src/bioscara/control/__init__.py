"""Control: measured states come in, bounded commands go out, each cycle.

``loop`` runs ``manager`` on time. The manager updates the active ``controllers``; ``limits`` bounds
every command, independent of its source. ``faults`` watches each cycle and stops the arm.
"""
