"""Real data in: any table of a building automation system, logger or database becomes telemetry of a case."""
