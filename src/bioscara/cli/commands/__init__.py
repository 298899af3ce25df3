"""The commands, one module each, in folders; ``cli/arguments.py`` has their arguments."""
