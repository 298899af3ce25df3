"""The commands: their names, their help in a line, and their modules, imported when called.

``motion`` has the commands that move the arm or plan. ``serving`` has the commands that let other
programs use an arm, record or show it, ``owners`` those about arms that are served. ``setup`` has
the commands for joints, boards, poses, tools and the model. A module has two functions:
``arguments`` adds those of its command to its parser, ``run`` carries it out with the parsed values
and returns the exit status, or None for 0. It raises a ``BioscaraError`` where it is refused or
fails before anything moved, for example because the arm cannot be used or no owner runs. The
imports of an action are in ``run``: help and the refusal of wrong usage do not wait for them.
"""

COMMANDS = {
    "demo": ("motion.demo", "Home the arm, run the demonstration trajectory, report."),
    "run": (
        "motion.run",
        "Home the arm, run a trajectory file and report, or a sequence of steps.",
    ),
    "plan": ("motion.plan", "Plan a motion and describe it; no arm is needed."),
    "move": ("motion.move", "Home the arm where necessary and move it to a target."),
    "home": (
        "motion.home",
        "Home the joints that are not homed; the elbow must be open, the gripper empty.",
    ),
    "jog": (
        "motion.jog",
        "Home the arm where necessary and move it by the keyboard, as long as a key is held.",
    ),
    "gripper": ("motion.gripper", "Move the jaws of the gripper."),
    "enable": (
        "motion.enable",
        "Enable the joints where they stand and hold them until Ctrl-C; nothing moves.",
    ),
    "disable": ("motion.disable", "Bring the joints to rest and disable them; loads may sink."),
    "monitor": ("motion.monitor", "Show the joints live until Ctrl-C, without enabling them."),
    "joints": ("setup.joints", "List the joints on a bus; nothing moves."),
    "faults": (
        "motion.faults",
        "List the faults that stopped the arm, and what to do about each.",
    ),
    "acknowledge": (
        "motion.faults",
        "Write the evidence of the faults; they stay until 'recover'.",
    ),
    "recover": (
        "motion.faults",
        "Acknowledge the faults and clear them in the joints; nothing moves.",
    ),
    "poses": ("setup.poses", "List, show, save or delete poses by name; nothing moves."),
    "tools": ("setup.tools", "List the tools, or add one to the teach file."),
    "view": (
        "serving.view",
        "Show a run, a trajectory, a plan or a running simulated arm in 3D in the browser, or the "
        "arm with a slider for each joint; nothing moves.",
    ),
    "export": (
        "setup.export",
        "Write the model of the arm for other programs, as MJCF, URDF or binary glTF.",
    ),
    "simulate": (
        "setup.simulate",
        "Run a simulated arm in real time, for other programs, until Ctrl-C.",
    ),
    "record": ("serving.record", "Record a served arm as MCAP files, or use them."),
    "flash": (
        "setup.flash",
        "Write the firmware of one or all joints to their boards, and verify it.",
    ),
    "serve": (
        "serving.serve",
        "Own an arm and let other programs use it, until Ctrl-C or SIGTERM.",
    ),
    "service": (
        "setup.service",
        "Serve an arm from the start of the computer on, as a service of systemd.",
    ),
    "stop": ("owners.stop", "Stop the motion of an arm, or of all that are served."),
    "pause": (
        "owners.pause",
        "Bring the motion of an arm, or of all that are served, to rest on its path until "
        "'bioscara resume'.",
    ),
    "resume": (
        "owners.resume",
        "Lift the pause of this user, and where no client commands the arm those of all.",
    ),
    "confirm": (
        "owners.confirm",
        "Confirm that zones, tool and load are still those of the owner's last run.",
    ),
    "arms": ("owners.arms", "List the arms that are served, their processes and their states."),
    "status": (
        "owners.status",
        "Show the state, the motion, the lease and the faults of an arm.",
    ),
    "lease": ("owners.lease", "Show the client that commands an arm, or end its lease."),
    "events": ("owners.events", "List what happened to an arm."),
    "logs": ("owners.logs", "List the log of the process that owns an arm."),
    "simulate-fault": (
        "owners.simulate_fault",
        "Let a served, simulated arm fail, also while a program moves it, or end that.",
    ),
    "disturb": (
        "owners.disturb",
        "Push, tilt, add or remove bodies of the world around a served, simulated arm, or list "
        "them.",
    ),
    "web": (
        "serving.web",
        "Let browsers and programs reach an arm that an owner serves, until Ctrl-C.",
    ),
    "completion": (
        "setup.completion",
        "Print the script by which bash, zsh or fish completes commands, options and names.",
    ),
    "ros": (
        "serving.ros",
        "Be the controller manager of an arm for clients of ROS 2, until Ctrl-C. All that follows "
        "--ros-args is for ROS.",
    ),
}
"""By name: module below this package, and help."""
