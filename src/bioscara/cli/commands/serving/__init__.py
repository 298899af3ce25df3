"""Commands that let other programs use an arm: its owner, gateways, recordings, the 3D view."""
