"""A system as a CasADi function, smooth for a controller."""

from collections.abc import Mapping
from typing import Any

import casadi

from thermal.components.component import Conditions
from thermal.components.operations import CasadiOperations
from thermal.system.exchange import advance
from thermal.system.step import HvacStep
from thermal.system.system import HvacSystem


def step_of(ops: CasadiOperations, system: HvacSystem, known: Mapping[str, Any]) -> HvacStep:
    """Take a system through a step of expressions, its thermostats without memory.

    Parameters
    ----------
    ops : CasadiOperations
        Arithmetic.
    system : HvacSystem
        The system.
    known : mapping of str to casadi.SX
        States by ``ENTITY/state``, fields of `Conditions` and ``seconds`` by name, actuators by point; pressures that
        are not there stay at their design values.
    """
    conditions = Conditions(*(known[name] for name in Conditions._fields))
    conditions = conditions._replace(return_humidity=tuple(casadi.vertsplit(known["return_humidity"])))
    points = [point for point in system.by_point if point in known]
    actions = system.actions(**{point: tuple(casadi.vertsplit(known[point])) for point in points})
    calls = system.thermostat.calls(ops, *conditions[:3])
    state = [known[key] for key in system.states]
    return advance(ops, system, state, calls, conditions, actions, known["seconds"])


def hvac_function(system: HvacSystem, width: float = 0.02) -> Any:
    """Build one step of a system as a CasADi function of its states, conditions and actions.

    Parameters
    ----------
    system : HvacSystem
        The system; its thermostats act without memory.
    width : float
        Smoothing width of limits and switches, as a share of each one's scale [-], 0 (exact) to 0.5. The default moves
        calls by at most 0.01.

    Returns
    -------
    casadi.Function
        Of SX. Inputs by name: the states, such as ``BOILER_supply_water_temperature`` [K]; the fields of `Conditions`,
        zones of shape (n_zone,), ``return_humidity`` of shape (n_air_handler,), of one
        for a system without air; the actuators by point, such as
        ``supply_air_temperature_setpoint`` [K], (n_air_handler,); ``seconds`` [s]. Outputs: the states at the end, such
        as ``BOILER_supply_water_temperature_end``; ``heat`` [W], (n_zone,); ``electric_power``, ``fuel_power`` [W];
        ``supply_temperature`` [K], (n_air_handler,); and what groups and loop did, such as ``VAV_airflow`` [kg/s],
        (n_terminal,), by component and field.

    Raises
    ------
    ModelError
        The width is out of its range.

    Examples
    --------
    >>> from thermal.components.air_handler import AirHandler
    >>> from thermal.components.boiler_loop import BoilerLoop
    >>> from thermal.components.fan import Fan
    >>> from thermal.components.pump import Pump
    >>> from thermal.components.terminals import Terminals
    >>> from thermal.system.system import vav_system
    >>> system = vav_system([AirHandler(Fan(1.0))], BoilerLoop(2e4, Pump(0.5)), Terminals.sized([0.5], 4000.0))
    >>> hvac_function(system).name_out()[:2]
    ['BOILER_supply_water_temperature_end', 'heat']
    """
    ops, n, n_air = CasadiOperations(width), system.zone_count, max(len(system.air_handlers), 1)
    sizes = dict.fromkeys(system.states, 1) | dict.fromkeys(Conditions._fields, 1)
    sizes |= dict.fromkeys(Conditions._fields[:3], n) | {"return_humidity": n_air}
    sizes |= {point: len(keys) for point, keys in system.by_point.items()} | {"seconds": 1}
    s = {name: casadi.SX.sym(name, size) for name, size in sizes.items()}
    done = step_of(ops, system, s)
    outputs = {f"{key}_end": value for key, value in zip(system.states, done.state, strict=True)}
    outputs |= {"heat": system.at_zones(ops, done.results), "electric_power": done.electric_power}
    outputs |= {"fuel_power": done.fuel_power, "supply_temperature": casadi.vertcat(*done.supply_temperature)}
    outputs |= {
        f"{name}/{field}": value
        for name, result in done.results.items()
        for field, value in result._asdict().items()
        if not isinstance(value, tuple) and f"{name}/{field}" not in system.states
    }
    given, found = ([casadi.Function.fix_name(name) for name in each] for each in (s, outputs))
    return casadi.Function("hvac", list(s.values()), list(outputs.values()), given, found)
