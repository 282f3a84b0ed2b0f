"""EnergyPlus' own reference buildings as a world of blind trials: what a model leaves out is switched off, or on."""
