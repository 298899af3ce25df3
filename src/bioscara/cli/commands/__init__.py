"""The commands, one module each, by the options that ``cli.arguments`` has parsed.

``motion`` has the commands that move the arm or plan. ``serving`` has the commands that own an arm,
show it or use a served one. ``setup`` has the commands for joints, boards, poses and tools. Each
module has a function ``run``.
"""
