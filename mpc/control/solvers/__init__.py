"""Solvers of the optimal control problem: never numbers without a status."""
