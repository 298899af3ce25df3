"""Commands that move the arm, plan that, or deal with its faults."""
