"""Many buildings at once, on any executor."""
