"""Trajectories and scenes as files.

``trajectory_file`` reads and writes ROS 2 YAML and CSV, ``scene_file`` reads scenes.
"""
