"""The commands, one module each; ``bioscara NAME`` runs ``NAME.py``."""
