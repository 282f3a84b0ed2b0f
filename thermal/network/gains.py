"""Heat in each zone that no effect of the catalogue has: always there, and recurring from day to day."""

from collections.abc import Mapping

import numpy as np

from thermal._types import FloatArray
from thermal.inputs.signals import CONSTANT, daily_waves, waves_of_day
from thermal.network.graph import GraphBuilder
from thermal.network.structure import Structure
from thermal.parameters import PARAMETERS

#: Periods of a gain that recurs from day to day [h].
PERIODS = (24.0, 12.0, 8.0)


def add_gains(graph: GraphBuilder, structure: Structure) -> None:
    """Give the air of each zone heat per floor area that is always there, and that recurs from day to day.

    Parameters
    ----------
    graph : GraphBuilder
        A baseline with its rooms.
    structure : Structure
        Says whether it recurs.
    """
    waves = [("recurring_gain", wave) for wave in waves_of_day(*PERIODS)] if structure.recurring else []
    for room in graph.anatomy.rooms.values():
        for base, signal in [("constant_gain", CONSTANT), *waves]:
            member = room.name if signal is CONSTANT else f"{room.name}, {signal.name}"
            value, weight = graph.own(PARAMETERS[base].of("zone", member)), room.floor_area * np.asarray(room.share)
            graph.source(f"{base.replace('_', ' ')} {member}", value, room.air, signal, weight)


def daily_gains(zone: str, values: Mapping[str, float]) -> FloatArray:
    """Heat of a zone that recurs, at each full hour of the clock on the wall, shape (24,) [W/m2].

    Its mean is left out: what is always there has other reasons too.

    Parameters
    ----------
    zone : str
        Its name.
    values : mapping of str to float
        Parameters by name [parameter units]; 0 where there is none.

    Examples
    --------
    >>> course = daily_gains("living", {"recurring_gain@living, cos of 24 h": 2.0})
    >>> round(float(course[0]), 6), round(float(course[12]), 6)
    (2.0, -2.0)
    """
    size, hours, course = PARAMETERS["recurring_gain"], np.arange(24.0), np.zeros(24)
    for wave, of in daily_waves(*PERIODS).items():
        course += values.get(size.of("zone", f"{zone}, {wave}").name, 0.0) * of(hours)
    return course
