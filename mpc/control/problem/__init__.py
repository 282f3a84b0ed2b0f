"""The optimal control problem: cost, constraints, and the data of a horizon."""
