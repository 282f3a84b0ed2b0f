"""Grey boxes of buildings of which no geometry is known: a few nodes a zone, fitted to telemetry alone."""

__all__: list[str] = []
