"""What drives the effects of the catalogue: sun, sky, wind and schedules, from a case's telemetry."""
