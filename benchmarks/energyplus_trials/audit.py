"""What flows in a trial's building by EnergyPlus's own account: which terms there are, and that they balance."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from energyplus_trials import climate, plant
from energyplus_trials.plant import Plant, Variable

_AIR = {
    "gains": "Zone Air Heat Balance Internal Convective Heat Gain Rate",
    "surfaces": "Zone Air Heat Balance Surface Convection Rate",
    "zones": "Zone Air Heat Balance Interzone Air Transfer Rate",
    "outdoor_air": "Zone Air Heat Balance Outdoor Air Transfer Rate",
    "storage": "Zone Air Heat Balance Air Energy Storage Rate",
    "sun_through_glass": "Enclosure Windows Total Transmitted Solar Radiation Rate",
}
_OUTER = {
    "sun_on_walls": "Surface Outside Face Solar Radiation Heat Gain Rate",
    "film": "Surface Outside Face Convection Heat Transfer Coefficient",
}
_CONDUCTION = "Surface Inside Face Conduction Heat Transfer Rate"
_WINDOW = "Surface Window Net Heat Transfer Rate"
_SKY = "Site Sky Temperature"


@dataclass(frozen=True)
class Audit:
    """Account of a run.

    Parameters
    ----------
    terms : dict
        Mean absolute heat of each kind over zones (over outer walls) and time [W]; for `film` its standard deviation
        in time [W/m2/K], for `sky` the mean difference between air and sky [K].
    air : float
        What is left of the zones' heat balance, as a share of the mean absolute heat delivered [-].
    building : float
        What is left over the run of heat delivered, brought by air, stored in air, and conducted through or into
        everything that the zones look at, as a share of the mean absolute heat delivered [-]. Radiant gains, which
        surfaces get and the air does not, are missing from it.
    """

    terms: dict[str, float]
    air: float
    building: float


def audit(building: Plant) -> Audit:
    """Run a building and make its account, run-in left out.

    Parameters
    ----------
    building : Plant
        With effects.
    """
    opaque = list(building.objects["BuildingSurface:Detailed"]) + list(building.objects["InternalMass"])
    opaque += list(building.objects.get("Door", {}))
    panes = list(building.objects["Window"])
    outer = [
        name
        for name, surface in building.objects["BuildingSurface:Detailed"].items()
        if surface["outside_boundary_condition"] == "Outdoors"
    ]
    variables: list[Variable] = [("site", "sky", _SKY, "Environment")]
    variables += [(zone, ours, name, zone) for zone in building.spec.zone_names for ours, name in _AIR.items()]
    variables += [(surface, "conduction", _CONDUCTION, surface) for surface in opaque]
    variables += [(surface, "window", _WINDOW, surface) for surface in panes]
    variables += [(surface, ours, name, surface) for surface in outer for ours, name in _OUTER.items()]
    results = plant.simulate(building, variables).iloc[-building.spec.days * climate.STEPS_PER_DAY :]
    return _account(results)


def _account(results: pd.DataFrame) -> Audit:
    def of(name: str) -> pd.DataFrame:
        return results.xs(name, axis=1, level=1)

    terms = {name: float(of(name).abs().mean().mean()) for name in (*_AIR, "sun_on_walls")}
    terms["film"] = float(of("film").std().mean())
    outdoor = results["site", "outside_air_temperature_sensor"]
    terms["sky"] = float((outdoor - results["site", "sky"]).abs().mean())
    heat = of("heat")
    terms["heat"] = scale = float(heat.abs().mean().mean())
    left = heat + of("gains") + of("surfaces") + of("zones") + of("outdoor_air") - of("storage")
    brought = heat + of("gains") + of("zones") + of("outdoor_air") - of("storage")
    total = brought.sum(axis=1) + of("conduction").sum(axis=1) + of("window").sum(axis=1)
    air = float(left.abs().mean().mean()) / scale
    return Audit(terms, air, float(abs(total.mean())) / (scale * heat.shape[1]))
