"""Generated office: plans, devices, building, and a case of the size of the paper's pilot."""

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from thermal.case.building import (
    EXTERIOR_WALL,
    FACADES,
    INTERIOR_WALL,
    OUTSIDE,
    Building,
    Device,
    FloorPlan,
    FloorPlans,
    Location,
)
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.save import check_target, save_case
from thermal.errors import ThermalError
from thermal.model.simulator import Simulator
from thermal.pilot.outline import Mask, draw_outline, exterior_ring
from thermal.pilot.partition import Region, partition
from thermal.pilot.telemetry import Plant, Progress, TelemetrySettings, generate_telemetry
from thermal.pilot.weather import MOUNTAIN_VIEW, Period

_OUTLINES = 6  # outlines to draw before a size is refused
_NOTCHED_FROM = (1500.0, 20)  # m2 and zones a floor, from here on outlines may have notches
_MEAN_OVER_SMALLEST = 2.5  # -, denser than this hardly any outline can be cut
_GLAZING_DECIMALS = 2  # of m2, as drawings give it


def generate_office(
    seed: int = 0,
    *,
    floor_area: float = 6317.0,
    zones: int = 123,
    floors: int = 2,
    cell_size: float = 0.5,
    height: float = 3.0,
    window_to_wall_ratio: tuple[float, float] = (0.2, 0.5),
    min_zone_area: float = 8.0,
) -> FloorPlans:
    """Draw an office building: rooms along the facades, corridors behind them, a core, a window in every facade.

    All floors have the same outline, and each its own rooms. The floor area is that of zones and interior walls, all
    that is inside the exterior wall. Zone names tell floor and place: ``F1_S03`` is a room at a south facade,
    ``F1_H01`` a corridor, ``F1_C01`` a room of the core.

    Parameters
    ----------
    seed : int
        Same seed, same building; 0 or more.
    floor_area : float
        Of all floors together [m2], positive, met within 0.5 %. The default is the pilot building of Goldfeder and
        Sipple (2023), section 5: 68,000 square feet.
    zones : int
        On all floors together, at least one a floor, spread evenly. The default leaves 4 of the pilot's 127 devices for
        the plant.
    floors : int
        Number of storeys, at least 1; two in the pilot building.
    cell_size : float
        Side of a plan cell [m], positive; walls are one cell thick. Default as in the shared cases.
    height : float
        Clear height of a storey [m], positive. Default as in the shared cases.
    window_to_wall_ratio : tuple of float
        Smallest and largest share of glass in a zone's facade [-], from 0 to 1. The default is the usual range of
        offices (ASHRAE 90.1 allows 0.4 without further proof).
    min_zone_area : float
        Smallest zone [m2], positive; zones must have 2.5 times that on average. The default is a single office.

    Returns
    -------
    FloorPlans
        Plans of all floors, lowest first, and the glazed area of each zone and facade.

    Raises
    ------
    ThermalError
        When an argument is out of its range, or no plan with these zones is found.

    Examples
    --------
    >>> plans = generate_office(1, floor_area=600.0, zones=12)
    >>> [len(floor.zone_names) for floor in plans.floors]
    [6, 6]
    """
    low, high = window_to_wall_ratio
    ThermalError.unless(seed >= 0, "seed", "0 or more", seed)
    given = {"floor_area": floor_area, "cell_size": cell_size, "height": height, "min_zone_area": min_zone_area}
    for name, value in given.items():
        ThermalError.unless(np.isfinite(value) and value > 0.0, name, "a positive number", f"{value}")
    if floors < 1 or zones < floors:
        raise ThermalError(f"zones: expected at least one a floor on one or more floors, found {zones} on {floors}")
    most = int(floor_area / (_MEAN_OVER_SMALLEST * min_zone_area))
    fits, mean = zones <= most, f"{_MEAN_OVER_SMALLEST} times min_zone_area ({min_zone_area} m2) on average"
    ThermalError.unless(fits, "zones", f"at most {most} on {floor_area} m2, so that they have {mean}", f"{zones}")
    if not 0.0 <= low <= high <= 1.0:
        raise ThermalError(f"window_to_wall_ratio: expected (smallest, largest) between 0 and 1, found {low, high}")
    counts = [zones // floors + (floor < zones % floors) for floor in range(floors)]
    for attempt in range(_OUTLINES):
        rng = np.random.default_rng([seed, attempt])
        notched = floor_area / floors >= _NOTCHED_FROM[0] and counts[-1] >= _NOTCHED_FROM[1]
        mask = draw_outline(rng, floor_area / floors, cell_size, notched)
        storeys: list[FloorPlan] = []
        for number, count in enumerate(counts, start=1):
            regions = partition(rng, mask, count, cell_size, min_zone_area)
            if regions is None:
                break
            storeys.append(FloorPlan(f"F{number}", height, _tokens(f"F{number}", mask, regions)))
        if len(storeys) == floors:
            return FloorPlans(cell_size, tuple(storeys), _glazing(rng, storeys, cell_size, window_to_wall_ratio))
    expected = f"a number that fits {floor_area} m2 on {floors} floor(s), each {min_zone_area} m2 or more"
    found = f"{zones}, for which {_OUTLINES} outlines gave no plan"
    raise ThermalError("zones", expected, found, f"ask for fewer zones, or a smaller cell_size than {cell_size} m")


def devices(plans: FloorPlans) -> tuple[Device, ...]:
    """List the devices of an office: a VAV terminal in each zone, an air handler a floor, a boiler and a chiller.

    Terminals are fed by their floor's air handler and the boiler, air handlers by the boiler and the chiller.

    Parameters
    ----------
    plans : FloorPlans
        The building; the pilot's 123 zones on two floors make the paper's 127 devices.

    Returns
    -------
    tuple of Device
        Terminals in the order of the zones, named ``VAV_<zone>``, then ``AHU_<floor>``, ``BOILER``, ``CHILLER``.
    """
    zones = [(zone, f"AHU_{floor.name}") for floor in plans.floors for zone in floor.zone_names]
    terminals = (Device(name=f"VAV_{zone}", type="vav", zone=zone, fed_by=(ahu, "BOILER")) for zone, ahu in zones)
    handlers = (Device(name=f"AHU_{floor.name}", type="ahu", fed_by=("BOILER", "CHILLER")) for floor in plans.floors)
    return (*terminals, *handlers, Device(name="BOILER", type="boiler"), Device(name="CHILLER", type="chiller"))


def _tokens(floor: str, mask: Mask, regions: list[Region]) -> npt.NDArray[np.str_]:
    """Write zones and walls into the cells of a floor, numbering the zones of each place row by row."""
    tokens = np.full(mask.shape, OUTSIDE, dtype="U16")
    tokens[mask] = INTERIOR_WALL
    tokens[exterior_ring(mask)] = EXTERIOR_WALL
    count: dict[str, int] = {}
    for region in sorted(regions, key=lambda region: region.corner):
        place = FACADES[region.side][0].upper() if region.side >= 0 else {"corridor": "H", "core": "C"}[region.kind]
        count[place] = count.get(place, 0) + 1
        (row, column), (n_row, n_column) = region.corner, region.mask.shape
        tokens[row : row + n_row, column : column + n_column][region.mask] = f"{floor}_{place}{count[place]:02d}"
    return tokens


def _glazing(
    rng: np.random.Generator, storeys: list[FloorPlan], cell_size: float, ratio: tuple[float, float]
) -> MappingProxyType[str, MappingProxyType[str, float]]:
    """Draw the glazed area [m2] of each zone and facade."""
    glazing = {}
    for storey in storeys:
        exposed = {side: _exposed_cells(storey, turns) for turns, side in enumerate(FACADES)}
        for zone in storey.zone_names:
            walls = [(side, of[zone] * cell_size * storey.height) for side, of in exposed.items() if zone in of]
            areas = {side: round(wall * rng.uniform(*ratio), _GLAZING_DECIMALS) for side, wall in walls}
            if areas:
                glazing[zone] = MappingProxyType(areas)
    return MappingProxyType(glazing)


def _exposed_cells(storey: FloorPlan, turns: int) -> dict[str, int]:
    """Count the cells of each zone that have the exterior wall on one side."""
    tokens = np.rot90(storey.tokens, turns)
    beside = tokens[1:][tokens[:-1] == EXTERIOR_WALL]
    names, cells = np.unique(beside, return_counts=True)
    return dict(zip(names.tolist(), cells.tolist(), strict=True))


def pilot_building(
    seed: int = 0, *, floor_area: float = 6317.0, zones: int = 123, floors: int = 2, name: str = "pilot"
) -> Building:
    """Draw the pilot building: by default 6,317 m2, 123 zones and the paper's 127 devices.

    Parameters
    ----------
    seed : int
        Same seed, same building; 0 or more.
    floor_area : float
        Of all floors together [m2].
    zones, floors : int
        On all floors together; number of storeys.
    name : str
        Of the case.

    Returns
    -------
    Building
        With a terminal a zone, an air handler a floor, a boiler and a chiller.

    Examples
    --------
    >>> small = pilot_building(1, floor_area=600.0, zones=12)
    >>> len(small.zone_names), len(small.devices)
    (12, 16)
    """
    plans = generate_office(seed, floor_area=floor_area, zones=zones, floors=floors)
    return Building(name, MOUNTAIN_VIEW, 0.0, plans, devices(plans))


#: Makes the plant of a building that goes in steps of so many seconds [s].
PlantFactory = Callable[[Building, float], Plant]


def _own_simulator(building: Building, step_seconds: float) -> Plant:
    """Make the default plant: the grid model with the mean of the shuffle."""
    return Simulator(building, step_seconds=step_seconds)


@dataclass(frozen=True)
class PilotSettings(Period):
    """Size, place and period of a generated office.

    Parameters
    ----------
    floor_area : float
        Of all floors together [m2], positive; by default that of the paper's pilot building.
    zones : int
        On all floors together [-], at least one a floor; by default as many as the pilot has terminal units.
    floors : int
        Number of storeys [-], at least 1; two in the pilot building.
    cell_size : float
        Side of a plan cell [m], positive. Default as in the shared cases.
    orientation : float
        Direction of the plan's "up" [deg clockwise from north], -360 to 360.
    location : Location
        Where the building stands; by default the paper's pilot building's town.
    name : str
        Of the case.
    start : str
        As in `Period`.
    days, spin_up_days : float
        As in `Period` [d].
    step_seconds : float
        As in `Period` [s].
    """

    floor_area: float = 6317.0
    zones: int = 123
    floors: int = 2
    cell_size: float = 0.5
    orientation: float = 0.0
    location: Location = MOUNTAIN_VIEW
    name: str = "pilot"


def generate_pilot(
    path: str | PathLike[str],
    settings: PilotSettings | None = None,
    *,
    seed: int = 0,
    plant_factory: PlantFactory = _own_simulator,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Case:
    """Draw an office, run it through some weather, and save plans and telemetry as a case folder.

    Parameters
    ----------
    path : str or path-like
        Folder to make.
    settings : PilotSettings, optional
        Size, place and period.
    seed : int
        Same seed, same case [-]; 0 or more.
    plant_factory : callable
        Called as ``plant_factory(building, step_seconds)``; returns the plant that produces the telemetry.
        The library's own stepping simulator with its starting parameters by default.
    overwrite : bool
        Whether a case that is there already is replaced.
    progress : callable, optional
        Called as ``progress(steps_done, steps)`` after every step.

    Returns
    -------
    Case
        As it was saved and loaded again.

    Raises
    ------
    CaseError
        When the folder holds something and `overwrite` is not set.
    ThermalError
        When there is no office of this size.
    ThermalError
        When a length is out of range or the plant does not fit the building.
    """
    at, target = settings or PilotSettings(), Path(path)
    check_target(target, overwrite)  # before the long part
    plans = generate_office(seed, floor_area=at.floor_area, zones=at.zones, floors=at.floors, cell_size=at.cell_size)
    building = Building(at.name, at.location, at.orientation, plans, devices(plans))
    weather = at.weather(seed, at.location, building.weather_station)
    sensors = TelemetrySettings(seed, at.spin_up_days, building.weather_station)
    telemetry = generate_telemetry(plant_factory(building, at.step_seconds), plans, weather, sensors, progress=progress)
    save_case(Case(building, telemetry), target, overwrite=overwrite)
    return load_case(target)
