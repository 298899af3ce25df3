"""The control loop: one cycle at each deadline.

``loop`` counts and times the cycles; ``realtime`` and ``systemd`` talk to the operating system.
"""
