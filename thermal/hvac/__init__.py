"""Heating, ventilation and air conditioning: the plant of a building, for simulation and for control."""
