"""Models of plants that are known by a description and telemetry only: experiment, component maps, grey box."""

__all__: list[str] = []
