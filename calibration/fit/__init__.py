"""Parameters from telemetry by least squares."""
