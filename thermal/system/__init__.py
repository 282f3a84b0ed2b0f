"""Components joined into a system, compiled once to NumPy and to CasADi."""
