"""The commands, one module each, by the options that ``cli.arguments`` has parsed.

``motion`` has those that move the arm or plan, ``serving`` those that own an arm, show it or use a
served one, ``setup`` those for joints, boards, poses and tools. Each module has a function ``run``.
"""
