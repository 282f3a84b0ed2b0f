"""Optimal control on EnergyPlus' reference offices, beside their own control and an outdoor reset.

For each office and season there are two weeks of telemetry under its own control with mild excitation (thermostats
moved by up to 1 K, supply air by up to 3 K, three hours at a time) and sensor noise. The baseline is calibrated on
these and diagnosed; then four controllers run the week after, on the same weather:

- *own*: the building's schedules, 12.8 degC of supply air and 82.2 degC of water all year;
- *reset*: supply air (and water) by the outdoor temperature, `mpc.baselines.rules.OutdoorReset`;
- *MPC before*, *MPC after*: optimal control with the calibrated baseline, and with the effects of the diagnosis.

Optimal control decides the supply air of each air handler, and in the Large Office the hot water. It is given
EnergyPlus' sizes, measurements with noise and the weather file as forecast, and not what people, lights and equipment
will do.

Run: ``python benchmarks/mpc_energyplus.py --out results/mpc_energyplus [--publish]`` with the extra ``[energyplus]``;
some 25 minutes on one core. What is finished is kept, and the same command goes on from there: one file a run. Writes
``mpc_energyplus.json`` and ``.md``; with ``--publish`` also the table in ``mpc.md``.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from _code import code
from _energyplus_control import optimal
from _energyplus_offices import CONTROL_DAYS, HORIZON, OFFICES, Office, prepared
from _table import markdown, write

from mpc.adapters.energyplus.plant import EnergyPlusPlant
from mpc.baselines.plants import OwnControl
from mpc.baselines.rules import OutdoorReset
from mpc.errors import EnergyPlusError
from mpc.kpi.kpis import measure_kpis
from mpc.loop.run import run_closed_loop

CONTROLLERS = {"own": "own control", "reset": "outdoor reset", "before": "MPC before diagnosis", "after": "MPC after"}
COLUMNS = ("office", "week", "controller", "electricity, kWh", "gas, kWh", "cost, USD", "against own, %",
           "discomfort, K h a zone", "worst zone, K h")  # fmt: skip
KILOWATT_HOUR = 3.6e6  # J


def controller_of(name: str, plant: EnergyPlusPlant, models: dict[str, Any]) -> Any:
    """Make a controller by name."""
    if name == "own":
        return OwnControl()
    if name == "reset":
        return OutdoorReset(plant.actuators, plant.source.building.weather_station)
    return optimal(plant, models[name]["values"], models[name]["effects"])


def measured(office: Office, name: str, folder: Path, days: int, models: dict[str, Any]) -> dict[str, Any]:
    """Run a controller for the week after the telemetry, or read what it did."""
    path = folder / f"run_{name}.json"
    if path.exists():
        return json.loads(path.read_text(encoding="utf-8"))
    plant = office.plant(office.controlled, days, HORIZON)
    controller = controller_of(name, plant, models)
    begin = time.process_time()
    run = run_closed_loop(plant, controller, seed=2, forecasts=name in ("before", "after"))
    kpis = measure_kpis(run.record, plant.scenario)
    step = plant.scenario.grid.step
    data = {
        "office": office.key, "controller": name, "days": days, "code": code(),
        "electricity_kwh": float(run.record.electricity.sum()) * step / KILOWATT_HOUR,
        "gas_kwh": float(run.record.gas.sum()) * step / KILOWATT_HOUR,
        "cost": kpis.cost_tot * kpis.floor_area, "discomfort": kpis.tdis_tot,
        "worst": max((z.below + z.above, z.zone) for z in kpis.zones),
        "meters_kwh": {meter: energy / KILOWATT_HOUR for meter, energy in plant.metered().items()},
        "sources": dict(Counter(getattr(controller, "sources", ()))), "cpu_seconds": time.process_time() - begin,
        "mean_supply_air": float(run.measurements.filter(like="/supply_air_temperature_setpoint").to_numpy().mean()),
    }  # fmt: skip
    path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    run.actions.to_csv(folder / f"actions_{name}.csv")
    record = run.record
    np.savez_compressed(
        folder / f"record_{name}.npz", zone=record.zone_temperature, electricity=record.electricity, gas=record.gas
    )
    return data


def study(out: Path, keys: list[str], days: int, say: Callable[[str], None]) -> dict[str, Any]:
    """Run what is asked for and not there yet."""
    results: dict[str, Any] = {}
    for key in keys:
        office, folder = OFFICES[key], out / key
        folder.mkdir(parents=True, exist_ok=True)
        models = prepared(office, folder)
        results[key] = {"models": models, "runs": {}}
        say(f"{key}: {', '.join(models['after']['effects'])}; {models['held_out_mae']}")
        for name in CONTROLLERS:
            results[key]["runs"][name] = measured(office, name, folder, days, models)
            run = results[key]["runs"][name]
            say(f"{key} {name}: {run['cost']:.1f} USD, {run['discomfort']:.2f} K h, {run['cpu_seconds']:.0f} s")
    return results


def table_of(results: dict[str, Any]) -> str:
    """Lay the results out."""
    rows = []
    for key, found in results.items():
        own = found["runs"]["own"]["cost"]
        for name, run in found["runs"].items():
            rows.append((
                OFFICES[key].name, OFFICES[key].season, CONTROLLERS[name], f"{run['electricity_kwh']:.0f}",
                f"{run['gas_kwh']:.0f}", f"{run['cost']:.0f}", f"{100.0 * (run['cost'] / own - 1.0):+.1f}",
                f"{run['discomfort']:.2f}", f"{run['worst'][0]:.1f}",
            ))  # fmt: skip
    return markdown(COLUMNS, rows)


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/mpc_energyplus"))
    parser.add_argument("--offices", nargs="+", default=list(OFFICES), choices=list(OFFICES))
    parser.add_argument("--days", type=int, default=CONTROL_DAYS)
    parser.add_argument("--anew", action="store_true", help="forget what is finished")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    if options.anew:
        shutil.rmtree(options.out, ignore_errors=True)
    try:
        results = study(options.out, options.offices, options.days, lambda text: print(text, flush=True))
    except EnergyPlusError as error:
        print(error, file=sys.stderr)
        return 1
    table = table_of(results)
    write(options.out, "mpc_energyplus", table, results, options.publish)
    print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
