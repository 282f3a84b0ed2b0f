"""EnergyPlus' reference buildings as plants, by its runtime interface (extra ``[energyplus]``)."""
