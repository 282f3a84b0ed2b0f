"""The plant as a CasADi function, smooth for a controller."""

from __future__ import annotations

from typing import Any

import casadi

from thermal.hvac._advance import advance
from thermal.hvac._operations import CasadiOperations
from thermal.hvac._settings import settings_of
from thermal.hvac._step import Actions, Calls, Conditions
from thermal.hvac._system import HvacSystem


def hvac_function(system: HvacSystem, width: float = 0.02) -> Any:
    """Build one step of a plant as a CasADi function of its state, conditions and actions.

    Parameters
    ----------
    system : HvacSystem
        The plant; its thermostats act without memory.
    width : float
        Smoothing width of limits and switches, as a share of each one's scale [-], 0 (exact) to 0.5. The default moves
        calls by at most 0.01.

    Returns
    -------
    casadi.Function
        Of SX. Inputs by name: ``water`` [K]; ``zone_temperature``, ``heating_setpoint``, ``cooling_setpoint`` [K],
        (n_zone,); ``outdoor_temperature`` [K]; ``outdoor_humidity`` [kg/kg]; ``return_humidity`` [kg/kg],
        (n_air_handler,); ``room_temperature`` [K]; ``supply_air_temperature`` [K], (n_air_handler,);
        ``supply_water_temperature`` [K]; ``static_pressure`` [Pa], (n_air_handler,); ``differential_pressure`` [Pa];
        ``running`` [-], (n_air_handler,); ``boiler`` [-]; ``ventilation`` [-], (n_air_handler,); ``seconds`` [s].
        Outputs: ``water_end`` [K]; ``heat`` [W], (n_zone,); ``electric_power``, ``fuel_power`` [W]; ``airflow``
        [kg/s], ``discharge`` [K], ``reheat`` [W], (n_terminal,); ``supply_temperature`` [K], (n_air_handler,);
        ``return_water`` [K]; ``pump_power`` [W].

    Raises
    ------
    ModelError
        The width is out of its range.

    Examples
    --------
    >>> from thermal.hvac._air_handler import AirHandler
    >>> from thermal.hvac._boiler import BoilerLoop, Pump
    >>> from thermal.hvac._fan import Fan
    >>> from thermal.hvac._system import HvacSystem
    >>> from thermal.hvac._terminals import Terminals
    >>> system = HvacSystem((AirHandler(Fan(1.0)),), BoilerLoop(2e4, Pump(0.5)), Terminals.sized([0.5], 4000.0))
    >>> hvac_function(system).name_out()[:2]
    ['water_end', 'heat']
    """
    ops, n, n_air = CasadiOperations(width), system.zone_count, len(system.air_handlers)
    sizes = {
        "water": 1, "zone_temperature": n, "heating_setpoint": n, "cooling_setpoint": n, "outdoor_temperature": 1,
        "outdoor_humidity": 1, "return_humidity": n_air, "room_temperature": 1, "supply_air_temperature": n_air,
        "supply_water_temperature": 1, "static_pressure": n_air, "differential_pressure": 1, "running": n_air,
        "boiler": 1, "ventilation": n_air, "seconds": 1,
    }  # fmt: skip
    s = {name: casadi.SX.sym(name, size) for name, size in sizes.items()}
    split = {name: tuple(casadi.vertsplit(v)) for name, v in s.items()}
    heat, cool = system.thermostat.calls(ops, s["zone_temperature"], s["heating_setpoint"], s["cooling_setpoint"])
    actions = Actions(
        split["supply_air_temperature"], s["supply_water_temperature"], split["static_pressure"],
        s["differential_pressure"], split["running"], s["boiler"], split["ventilation"],
    )  # fmt: skip
    done = advance(
        ops,
        system,
        s["water"],
        Calls(system.at_terminals(ops, heat), system.at_terminals(ops, cool)),
        Conditions(
            s["zone_temperature"], s["heating_setpoint"], s["cooling_setpoint"], s["outdoor_temperature"],
            s["outdoor_humidity"], split["return_humidity"], s["room_temperature"],
        ),
        settings_of(ops, system, actions),
        s["seconds"],
    )  # fmt: skip
    outputs = {
        "water_end": done.loop.water,
        "heat": system.at_zones(ops, done.terminal_heat),
        "electric_power": done.electric_power,
        "fuel_power": done.fuel_power,
        "airflow": done.airflow,
        "discharge": done.discharge,
        "reheat": done.reheat,
        "supply_temperature": casadi.vertcat(*done.supply_temperature),
        "return_water": done.return_water,
        "pump_power": done.pump_power,
    }
    return casadi.Function("hvac", list(s.values()), list(outputs.values()), list(s), list(outputs))
