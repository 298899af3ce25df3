"""Named tools and poses of one arm, and the file that keeps them.

Begin with ``poses``: a ``TeachTable`` holds named poses and ``tools``. ``teach_file`` loads and
saves a table as YAML.
"""
