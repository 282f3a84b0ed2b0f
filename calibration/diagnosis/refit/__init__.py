"""Effects fitted together with all that was accepted before."""
