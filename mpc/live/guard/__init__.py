"""The guard: the only process that writes to the building, and what it lets through."""
