"""Package of buildingmpc."""
