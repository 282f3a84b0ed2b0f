"""Many plants of one structure at once: parameters, weather, people and noise of their own, one program for all."""
