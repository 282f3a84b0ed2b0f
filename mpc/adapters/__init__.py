"""Plants that others wrote, behind the same few methods as ours: BOPTEST, EnergyPlus, functional mock-up units."""
