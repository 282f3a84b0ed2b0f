"""Control volumes and faces of a building, as one graph."""
