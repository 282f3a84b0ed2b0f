"""A historian of 890 points at one minute, read as a case: how fast, plain and packed, and how much memory.

A PostgreSQL server of its own is filled with some days of the pilot building's points, as live operation's tables have
them. The case is made as `buildingmpc case from` makes it, at steps of 5 minutes. Of samples as they come, and of
packed ones at steps that are no whole slots, a year is so many days at the same rate. The year of packed slots is
whole on disk: its days are the first one again, for 468 million samples beneath them would be read by nobody.

Run: ``python benchmarks/historian_case.py --days 2 --publish --out results/historian``; some minutes.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from pathlib import Path

import pandas as pd
from _postgres import PostgresServer
from _table import markdown, write

from mpc.live.historian.store import Historian
from thermal import Building, Case, save_case
from thermal.intake.historian import historian_telemetry, pack_days
from thermal.pilot.building import pilot_building

START, STEP, POINTS = pd.Timestamp("2026-01-01", tz="UTC"), 300.0, 890

_OF_DEVICE = ("zone_air_temperature_sensor", "supply_air_flowrate_sensor", "discharge_air_temperature_sensor",
              "supply_air_damper_percentage_command", "heating_water_valve_percentage_command",
              "zone_air_heating_temperature_setpoint", "zone_air_cooling_temperature_setpoint",
              "heating_power_sensor")  # fmt: skip

#: Of a server that keeps the samples in memory.
MEMORY = "-c shared_buffers=512MB -c max_wal_size=8GB"


def fill(address: str, building: Building, days: int) -> None:
    """Write a sample a minute of every point, in the order of time."""
    import psycopg

    names = [f"{d.name}/{p}" for d in building.devices if d.zone for p in _OF_DEVICE][:POINTS]
    with Historian(address) as historian:
        historian.migrate()
    with psycopg.connect(address, autocommit=True) as connection:
        connection.execute("SET search_path = buildingmpc")
        connection.execute("INSERT INTO point (name) SELECT unnest(%s::text[])", [names])
        connection.execute(
            "INSERT INTO sample SELECT id, t, 0.5 + 0.4 * sin(extract(epoch FROM t) / 9000 + id) FROM "
            "generate_series(%s + interval '1 minute', %s, interval '1 minute') t, point",
            [START, START + pd.Timedelta(days=days)],
        )
        connection.execute("VACUUM ANALYZE sample")


def fill_year(address: str) -> None:
    """Repeat the first packed day's slots until there is a year of them."""
    import psycopg

    with psycopg.connect(address, autocommit=True) as connection:
        connection.execute("SET search_path = buildingmpc")
        connection.execute(
            "INSERT INTO packed_slots SELECT %s::date + n, points, sums, counts FROM packed_slots, "
            "generate_series(0, 365) n WHERE day = %s ON CONFLICT DO NOTHING",
            [START.date(), START.date()],
        )  # fmt: skip
        connection.execute("CHECKPOINT")


def main() -> None:
    """Make the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/historian"))
    parser.add_argument("--days", type=int, default=2)
    parser.add_argument("--publish", action="store_true")
    arguments = parser.parse_args()
    building, rows = pilot_building(1), []
    end = START + pd.Timedelta(days=arguments.days)
    with tempfile.TemporaryDirectory() as work:
        Path(work).chmod(0o755)
        server = PostgresServer(Path(tempfile.mkdtemp(dir=work)), MEMORY)
        server.start()
        try:
            address = server.address
            fill(address, building, arguments.days)
            whole = START + pd.Timedelta(days=365)
            for kind, step, until in (("as they come", STEP, end), ("packed, steps of 4 minutes", 240.0, end),
                                      ("packed, whole slots", STEP, end), ("packed, whole slots", STEP, whole)):
                if step != STEP:
                    pack_days(address, end)
                if until == whole:
                    fill_year(address)
                days = (until - START).days
                wall, used = time.perf_counter(), time.process_time()
                found = historian_telemetry(building, address, (START, until), step)
                read, cpu = time.perf_counter() - wall, time.process_time() - used
                wall = time.perf_counter()
                save_case(Case(building, found.telemetry), Path(work) / f"{kind} {days}")
                saved = time.perf_counter() - wall
                samples = found.telemetry.frame.shape[1] * 1440 * days
                memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
                rows.append([kind, days, found.telemetry.frame.shape[1], samples, read, cpu, samples / read / 1e6,
                             read / days * 365, saved, memory])  # fmt: skip
        finally:
            server.stop()
    heads = ["samples are", "days", "points", "samples", "made [s]", "of it our CPU [s]", "million samples a second",
             "a year at that rate [s]", "checked and saved [s]", "most memory [GB]"]  # fmt: skip
    table = markdown(heads, rows)
    write(arguments.out, "historian_case", table, {"rows": rows}, arguments.publish)
    print(table)


if __name__ == "__main__":
    main()
