"""Experiments that tell apart what the telemetry of a building cannot."""
