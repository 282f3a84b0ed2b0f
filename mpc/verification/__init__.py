"""Measurement and verification: what a change of control has saved, with intervals and what would make them invalid."""

__all__: list[str] = []
