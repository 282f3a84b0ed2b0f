"""The controller in closed loop: reads, estimates, solves, watches for faults, and falls back."""
