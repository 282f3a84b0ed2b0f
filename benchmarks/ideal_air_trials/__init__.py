"""Offices in EnergyPlus with ideal air that is limited in heat and cold, for blind trials of a diagnosis."""
