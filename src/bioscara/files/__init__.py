"""Files that are written whole or not at all, and opened without surprises.

Begin with ``whole_files``. ``regular_file`` opens regular files without following links, and
``locked_folder`` makes temporary folders, which are removed after their program was killed.
"""
