"""Small offices of one population, made by the library's own model: what fleets are tried on.

True parameters are normal about a centre that is not the drawing's, on the estimation scale: the centre lies 0.8 of a
prior's deviations from the start, in a direction that is drawn once for all, and buildings spread about it by 0.25 of
one. So buildings of one builder and age may be: alike, and not as the handbook has them. Unmeasured heat and sensors
are those of `TwinRanges`, drawn for each building.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from thermal.case.building import Building
from thermal.case.save import save_case
from thermal.network.build import build_network
from thermal.pilot.building import devices, generate_office
from thermal.pilot.twin import TwinSettings, generate_twin
from thermal.pilot.weather import MOUNTAIN_VIEW

#: Distance of the population's centre from the drawing's start, and its spread, in deviations of the prior [-].
APART, SPREAD = 0.8, 0.25

#: Stream of random numbers of the centre.
_CENTRE = 20271

CELL = 2.0  # m, of plans and of the model's grid


def population_centre(names: list[str]) -> dict[str, float]:
    """Centre of the population in deviations of each prior [-]; the same for a name whatever the others are."""
    return {n: APART * np.random.default_rng([_CENTRE, *n.encode()]).choice([-1.0, 1.0]) for n in names}


def make_office(
    folder: Path, seed: int, days: float = 7.0, step_seconds: float = 1800.0, spread: float = SPREAD
) -> dict[str, float]:
    """Save an office of 80 m2 and 2 zones with its telemetry; return its true parameters."""
    plans = generate_office(seed, floor_area=80.0, zones=2, floors=1, cell_size=CELL)
    building = Building(folder.name, MOUNTAIN_VIEW, 0.0, plans, devices(plans))
    parameters = build_network(building).parameters
    centre = population_centre([p.name for p in parameters])
    rng = np.random.default_rng([_CENTRE, seed])
    truth = {}
    for p in parameters:
        z = p.transform(p.start) + p.prior_deviation * (centre[p.name] + spread * rng.standard_normal())
        truth[p.name] = float(np.clip(p.inverse(z), p.lower, p.upper))
    settings = TwinSettings(days=days, spin_up_days=3.0, step_seconds=step_seconds, fixed=truth)
    case, _ = generate_twin(building, seed, settings)
    save_case(case, folder)
    return truth
