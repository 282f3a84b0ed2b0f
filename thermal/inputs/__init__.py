"""What drives a model, by name, unit and time: from telemetry, a scenario, a forecast or a live feed."""
