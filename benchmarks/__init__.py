"""Speed and size, as ratios against a peer or a limit within the same run.

``python -m benchmarks`` runs every module below and writes docs/benchmarks.md. A module offers
``rows()``; each row says what was measured, against what, and whether it holds.
"""
