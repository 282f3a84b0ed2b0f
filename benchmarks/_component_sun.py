"""Sun on a facade and through its glass beside EnergyPlus' for `components_energyplus`: a box with a pane a side."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from _component_models import STEPS_PER_HOUR, YEAR, Row, column, head, idf, outputs, row, run

from thermal.case.building import Location
from thermal.inputs.sun import sun_of

#: Where the weather file is from.
PLACE = Location(latitude=41.98, longitude=-87.92, elevation=201.0, timezone="Etc/GMT+6")
SIDES = {"south": 180.0, "east": 90.0, "north": 0.0, "west": 270.0}  # deg
AREA, PANE = 30.0, 6.0  # m2
TRANSMITTANCE, REFLECTANCE = 0.837, 0.075  # of a clear pane of 3 mm
#: Of two of them with all that is reflected between them.
DOUBLE = TRANSMITTANCE**2 / (1.0 - REFLECTANCE**2)
_INCIDENT = "Surface Outside Face Incident Solar Radiation Rate per Area"
_THROUGH = "Surface Window Transmitted Solar Radiation Rate"
_NORMAL, _DIFFUSE = (f"Site {kind} Solar Radiation Rate per Area" for kind in ("Direct", "Diffuse"))


def compared(folder: Path, last: tuple[int, int] = YEAR) -> list[Row]:
    """Run EnergyPlus' model and ours.

    EnergyPlus has the sun of a step where it is at its end, and we where it is in its middle: ours get stamps that are
    half a step later.
    """
    table = run(_model(last), folder)
    half = pd.Timedelta(hours=0.5 / STEPS_PER_HOUR)
    stamps = pd.date_range("2017-01-01", periods=len(table), freq=2 * half, tz=PLACE.timezone) + 3 * half
    weather = pd.DataFrame(
        {
            "direct_normal_irradiance_sensor": column(table, "Environment", _NORMAL),
            "diffuse_horizontal_irradiance_sensor": column(table, "Environment", _DIFFUSE),
        },
        index=stamps,
    )
    sun, rows = sun_of(PLACE, stamps, 2.0 * half.total_seconds(), weather), list[Row]()
    for side, azimuth in SIDES.items():
        incident, through = column(table, side, _INCIDENT), column(table, f"{side} pane", _THROUGH)
        ours = sum(sun.plane(azimuth, 90.0)), DOUBLE * PANE * sun.through_glass(azimuth, 90.0)
        rows.append(row("sun on facades", "BuildingSurface:Detailed", f"on {side}", AREA * incident, AREA * ours[0]))
        rows.append(row("sun through panes", "FenestrationSurface:Detailed", f"from {side}", through, ours[1]))
    return rows


def _model(last: tuple[int, int]) -> str:
    """Write a box of 10 by 10 by 3 m that nobody heats, with a pane of two by three metres a side."""
    low = [(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)]
    up = [(x, y, 3) for x, y, _ in low]
    parts = [
        head("sun", last),
        idf("Material", "concrete", "Rough", 0.1, 1.7, 2300, 900), idf("Construction", "shell", "concrete"),
        idf("WindowMaterial:Glazing", "clear", "SpectralAverage", None, 0.003, TRANSMITTANCE, REFLECTANCE, REFLECTANCE,
            0.898, 0.081, 0.081, 0, 0.84, 0.84, 0.9),
        idf("WindowMaterial:Gas", "gap", "Air", 0.013), idf("Construction", "double", "clear", "gap", "clear"),
        idf("Zone", "box", 0, 0, 0, 0, 1, 1, 3, 300),
        _surface("floor", "Floor", low[::-1], ("Ground", None, "NoSun", "NoWind")), _surface("roof", "Roof", up),
    ]  # fmt: skip
    for i, side in enumerate(("south", "east", "north", "west")):
        (x, y, _), (u, v, _) = low[i], low[(i + 1) % 4]
        parts.append(_surface(side, "Wall", [up[i], low[i], low[(i + 1) % 4], up[(i + 1) % 4]]))
        begin, end = ((x + share * (u - x), y + share * (v - y)) for share in (0.3, 0.6))
        corners = [(*begin, 2.5), (*begin, 0.5), (*end, 0.5), (*end, 2.5)]
        flat = (value for corner in corners for value in corner)
        parts.append(idf("FenestrationSurface:Detailed", f"{side} pane", "Window", "double", side, None,
                         "autocalculate", None, 1, 4, *flat))  # fmt: skip
    parts += [outputs("*", _INCIDENT, _THROUGH), outputs("*", _NORMAL, _DIFFUSE)]
    return "".join(parts)


def _surface(
    name: str,
    kind: str,
    corners: list[tuple[float, float, float]],
    behind: tuple[str | None, ...] = ("Outdoors", None, "SunExposed", "WindExposed"),
) -> str:
    flat = (value for corner in corners for value in corner)
    return idf("BuildingSurface:Detailed", name, kind, "shell", "box", None, *behind, "autocalculate", 4, *flat)
