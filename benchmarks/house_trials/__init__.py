"""Houses in EnergyPlus with radiators or heated floors and people in them, for blind trials of a diagnosis."""
