"""Monitoring: telemetry of many weeks, day by day, for the day since when something has changed, and what."""
