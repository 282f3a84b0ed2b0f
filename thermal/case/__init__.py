"""Cases: a building and a stretch of its telemetry, read from a folder."""
