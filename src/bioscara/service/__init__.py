"""The owner of an arm as a service of systemd: its files, their installation and their removal.

The files next to this module are installed as they are; the unit gets the path of Python.
"""
