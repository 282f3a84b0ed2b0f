"""Plants in EnergyPlus to develop on, made from EnergyPlus' own objects, each with a description ready to load."""
