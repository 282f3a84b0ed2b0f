"""Building and HVAC system over a horizon, with exact sensitivities."""
