"""Offices in EnergyPlus whose physics is switched on effect by effect, for blind trials of a diagnosis."""
