"""The bundled case's building in EnergyPlus: layout, input file, thermostats, run, sensors."""
