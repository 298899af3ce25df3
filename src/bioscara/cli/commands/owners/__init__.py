"""Commands about arms that are served: their states, events and pauses, and STOP."""
