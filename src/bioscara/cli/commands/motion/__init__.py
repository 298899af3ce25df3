"""Commands that move the arm, plan that, show the joints, or deal with faults."""
