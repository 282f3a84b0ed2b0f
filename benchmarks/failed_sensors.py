"""Sensors that are dead or stuck: what the zones that are left lose, and whether the diagnosis takes it for a cause.

One, three and six sensors of a kind fail, drawn by a seed: dead throughout, or stuck at their value from a third of the
telemetry on. Beside each other are the held-out error six hours ahead of the zones whose sensors all work, over that of
the same zones where no sensor fails, and the verdict of the diagnosis.

Run: ``python benchmarks/failed_sensors.py --case CASE --out results/failed [--publish]``. An interrupted run goes on
where it was.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from _code import code
from _table import markdown, publish, write

from calibration import CalibrationSettings, calibrate
from calibration.diagnosis.seek import seek
from thermal import Case, Telemetry, load_case

NAME = "failed_sensors"

#: Point of each kind of sensor, of a zone or of its devices.
SENSORS = {
    "zone temperature": "zone_air_temperature_sensor",
    "flow": "supply_air_flowrate_sensor",
    "discharge temperature": "discharge_air_temperature_sensor",
}

COUNTS = 1, 3, 6


def failed(case: Case, kind: str, how: str, zones: list[str]) -> Case:
    """Let the sensors of some zones fail.

    Parameters
    ----------
    case : Case
        Where all work.
    kind : str
        Of `SENSORS`.
    how : {"dead", "stuck"}
        Throughout, or at one value from a third of the telemetry on.
    zones : list of str
        Whose sensors.
    """
    frame, point = case.telemetry.frame.copy(), SENSORS[kind]
    begin = len(frame) // 3
    for zone in zones:
        owners = [zone, *(device.name for device in case.building.devices_of(zone))]
        columns = [f"{owner}/{point}" for owner in owners if f"{owner}/{point}" in frame]
        if not columns:
            raise SystemExit(f"{zone}: expected a column .../{point} of the zone or its devices, found none")
        for column in columns:
            if how == "dead":
                frame[column] = np.nan
            else:
                frame.loc[frame.index[begin] :, column] = frame[column].iloc[begin]
    return Case(case.building, Telemetry(frame, case.step, case.telemetry.missing_rows))


def measure(case: Case, dx: float) -> dict[str, Any]:
    """Calibrate and diagnose; errors of every zone and the verdict."""
    held_out = calibrate(case, settings=CalibrationSettings(dx=dx)).calibrated["held_out"]
    answer = seek(case, dx=dx).verdict
    by_zone = {zone: e["mae"] for zone, e in held_out.by_zone().items()}
    return {"by_zone": by_zone, "verdict": answer.name, "first": answer.candidates[0].effect, "code": code()}


def main() -> None:
    """Measure every failure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", type=Path, required=True, help="case folder of a building where nothing is missing")
    parser.add_argument("--out", type=Path, default=Path("results/failed"), help="folder of the results")
    parser.add_argument("--dx", type=float, default=1.0, help="distance between control volumes [m]")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    whole = load_case(options.case)
    options.out.mkdir(parents=True, exist_ok=True)
    store = options.out / "runs.json"
    done: dict[str, Any] = json.loads(store.read_text(encoding="utf-8")) if store.exists() else {}

    def kept(name: str, case: Case) -> dict[str, Any]:
        if name not in done:
            done[name] = measure(case, options.dx)
            store.write_text(json.dumps(done, indent=1) + "\n", encoding="utf-8")
            print(f"{name}: {done[name]['verdict']}", flush=True)
        return dict(done[name])

    base, rows = kept("none", whole), []
    order = [str(z) for z in np.random.default_rng(0).permutation(list(whole.building.zone_names))]
    for kind in SENSORS:
        for how in ("dead", "stuck"):
            cells = []
            for count in COUNTS:
                found = kept(f"{count} {kind} {how}", failed(whole, kind, how, order[:count]))
                left = [z for z in order[count:] if z in found["by_zone"]]
                ratio = np.mean([found["by_zone"][z] for z in left]) / np.mean([base["by_zone"][z] for z in left])
                cells.append(f"{ratio:.2f}, {found['verdict']}")
            rows.append([f"{kind}, {how}", *cells])
    error = float(np.mean(list(base["by_zone"].values())))
    head = f"`{whole.building.name}`, {len(order)} zones, {error:.3f} K and {base['verdict']} where none fails."
    table = f"{head}\n\n{markdown(('sensors', *map(str, COUNTS)), rows)}"
    write(options.out, NAME, table, done, published=False)
    if options.publish:
        publish(NAME, table)
    print(table)


if __name__ == "__main__":
    main()
