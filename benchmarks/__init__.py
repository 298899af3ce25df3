"""Speed and size, as ratios against a peer or a limit within the same run.

``python -m benchmarks`` runs every module below and writes docs/benchmarks.md. A module offers
``rows()``; each row holds the measured quantity, its reference, and whether it is within the limit.
"""
