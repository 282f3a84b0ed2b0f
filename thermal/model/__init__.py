"""The symbolic model and what runs it."""
