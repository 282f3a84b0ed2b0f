"""What flows in a trial's house by EnergyPlus's own account: which terms there are, and that rooms balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from energyplus_trials import climate

from house_trials import plant
from house_trials.plant import Plant, Variable

_AIR = {
    "gains": "Zone Air Heat Balance Internal Convective Heat Gain Rate",
    "surfaces": "Zone Air Heat Balance Surface Convection Rate",
    "rooms": "Zone Air Heat Balance Interzone Air Transfer Rate",
    "outdoor_air": "Zone Air Heat Balance Outdoor Air Transfer Rate",
    "system": "Zone Air Heat Balance System Air Transfer Rate",
    "storage": "Zone Air Heat Balance Air Energy Storage Rate",
    "sun_through_glass": "Enclosure Windows Total Transmitted Solar Radiation Rate",
}
_CONDUCTION = "Surface Inside Face Conduction Heat Transfer Rate"
_WINDOW, _ON_WINDOW = (
    "Surface Window Net Heat Transfer Rate",
    "Surface Inside Face Internal Gains Radiation Heat Gain Rate",
)
_SUN, _FILM = (
    "Surface Outside Face Solar Radiation Heat Gain Rate",
    "Surface Outside Face Convection Heat Transfer Coefficient",
)


@dataclass(frozen=True)
class Audit:
    """Account of a run.

    Parameters
    ----------
    terms : dict
        Mean absolute heat of each kind over rooms (over outer walls) and time [W]; for `film` its standard deviation in
        time [W/m2/K], for `sky` the mean difference between air and sky [K].
    air : dict
        What is left of each room's air balance, as a share of the mean heat that is given to a heated room [-].
    house : float
        What is left over the run of heat given, brought by air, stored in air, and conducted through or into everything
        that rooms look at, as a share of the heat given [-]. What pipes give a floor passes its inner
        face as conduction.
    """

    terms: dict[str, float]
    air: dict[str, float]
    house: float


def audit(house: Plant) -> Audit:
    """Run a house and account for the heat in its rooms.

    Parameters
    ----------
    house : Plant
        As `trial.build` returns it.
    """
    objects, rooms = house.objects, house.spec.zone_names
    surfaces = objects["BuildingSurface:Detailed"]
    opaque = [*surfaces, *objects["InternalMass"]]
    outer = [name for name, fields in surfaces.items() if fields["outside_boundary_condition"] == "Outdoors"]
    variables: list[Variable] = [("site", "sky", "Site Sky Temperature", "Environment")]
    variables += [(room, f"air {ours}", name, room) for room in rooms for ours, name in _AIR.items()]
    variables += [(name, "conduction", _CONDUCTION, name) for name in opaque]
    panes = (
        (name, ours, full, name)
        for name in objects["Window"]
        for ours, full in (("window", _WINDOW), ("lit", _ON_WINDOW))
    )
    variables += panes
    variables += [(name, ours, full, name) for name in outer for ours, full in (("sun", _SUN), ("film", _FILM))]
    results = plant.simulate(house, variables)
    return _account(house, results, -house.spec.days * climate.STEPS_PER_DAY)


def _account(house: Plant, results: plant.Results, first: int) -> Audit:
    rows = results.outputs.iloc[first:]

    def of(name: str) -> pd.DataFrame:
        return rows.xs(name, axis=1, level=1)

    given = results.given.iloc[first:]
    scale = float(given.mean().mean())
    air = {name: of(f"air {name}") for name in _AIR}
    terms = {name: float(values.abs().mean().mean()) for name, values in air.items()}
    terms |= {
        "heat": scale,
        "sun_on_walls": float(of("sun").abs().mean().mean()),
        "film": float(of("film").std().mean()),
    }
    terms["sky"] = float((rows["site", "outside_air_temperature_sensor"] - rows["site", "sky"]).abs().mean())
    left = sum((air[name] for name in ("gains", "surfaces", "rooms", "outdoor_air", "system")), -air["storage"])
    radiant = sum(
        (house.spec.heating.radiant * given[room] for room, law in house.heaters.items() if not law["floor"]),
        pd.Series(0.0, given.index),
    )
    brought = sum((air[name] for name in ("gains", "outdoor_air", "system")), -air["storage"]).sum(axis=1) + radiant
    # A window's own account lacks what heaters radiate to it.
    through = of("conduction").sum(axis=1) + (of("window") - of("lit")).sum(axis=1)
    share = left.abs().mean() / scale
    return Audit(
        terms,
        {str(k): float(v) for k, v in share.items()},
        float(abs(np.mean(brought + through))) / (scale * given.shape[1]),
    )
