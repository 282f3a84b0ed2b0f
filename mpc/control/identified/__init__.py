"""Optimal control of plants that were identified: stages of a grey box with the maps of its machines."""

__all__: list[str] = []
