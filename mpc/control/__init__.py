"""Optimal control of supply setpoints over a receding horizon."""
