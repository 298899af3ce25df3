"""Commands that prepare an arm: joints and their firmware, poses, tools, a simulated arm."""
