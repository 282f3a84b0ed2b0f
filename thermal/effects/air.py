"""Air that comes from outdoor or from the next zone: infiltration, thermal bridges, open windows, mixing."""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import PAIR, Effect, Joining, paired, strength, without_facades
from thermal.inputs.drivers import WIND, Drivers, Signal
from thermal.network.topology import Anatomy, Room

#: Wind speed [m/s], root of temperature difference [K^0.5] and presence [-] at which a varying exchange is part of K;
#: what they differ from it acts as heat at usual zone temperatures. Unmeasured wind blows at this speed. Windows are no
#: part of K: where none is ever opened, it would tie the zones to their usual temperatures.
_WIND, _ROOT, _PRESENCE = 3.0, 3.0, 0.3

#: Outdoor temperatures between which windows come to be opened [K].
_MILD = (285.15, 295.15)

_SHERMAN = "Sherman and Grimsrud (1980); Coblenz and Achenbach coefficients in EnergyPlus Engineering Reference"


def _out(drivers: Drivers, zone: str) -> FloatArray:
    return np.asarray(drivers.outdoor - drivers.usual[:, drivers.zones.index(zone)])


def _by_wind(drivers: Drivers, zone: str) -> FloatArray:
    if not drivers.measured(WIND):
        return np.zeros(len(drivers.stamps))
    return (drivers.wind - _WIND) * _out(drivers, zone)


def _by_stack(drivers: Drivers, zone: str) -> FloatArray:
    difference = _out(drivers, zone)
    return (np.sqrt(np.abs(difference)) - _ROOT) * difference


def _by_opening(drivers: Drivers, zone: str) -> FloatArray:
    mild = np.clip((drivers.outdoor - _MILD[0]) / (_MILD[1] - _MILD[0]), 0.0, 1.0)
    return drivers.occupancy * mild * _out(drivers, zone)


def _by_hand(drivers: Drivers, zone: str) -> FloatArray:
    k = drivers.zones.index(zone)
    return np.asarray(drivers.openings[:, k] * drivers.through_windows[:, k])


def _by_presence(drivers: Drivers, first: str, second: str) -> FloatArray:
    usual = [drivers.usual[:, drivers.zones.index(z)] for z in (first, second)]
    return np.asarray((drivers.occupancy - _PRESENCE) * (usual[1] - usual[0]))


def _exposed(join: Joining) -> list[Room]:
    """Zones with an exterior wall; all of them where none is known."""
    outside = {zone for zone, _ in join.anatomy.facades}
    rooms = [r for r in join.rooms if r.name in outside]
    return rooms or list(join.rooms)


def _exchange(join: Joining, room: Room, rate: ca.SX, mean: float, varying: Signal | None) -> None:
    """Exchange a zone's air with outdoor at ``rate m(t)`` [1/h]: its mean by K, the rest as heat."""
    heat = join.anatomy.air_heat_capacity * room.volume / 3600.0
    join.air_to(room, rate, join.graph.boundary("outdoor"), mean * heat)
    if varying is not None:
        join.heat_air(room, rate, varying, heat)


def _build_infiltration(join: Joining) -> None:
    names = ("infiltration_rate", "infiltration_by_wind", "infiltration_by_stack")
    constant, wind, stack = (join.parameter(n) for n in names)
    for room in _exposed(join):
        _exchange(join, room, constant, 1.0, None)
        by_wind = Signal(f"wind and cold in {room.name}", "K*m/s", partial(_by_wind, zone=room.name))
        _exchange(join, room, wind, _WIND, by_wind)
        by_stack = Signal(f"stack and cold in {room.name}", "K^1.5", partial(_by_stack, zone=room.name))
        _exchange(join, room, stack, _ROOT, by_stack)


def _build_bridge(join: Joining) -> None:
    value = join.parameter("thermal_bridge_u_value")
    for (zone, _), area in join.anatomy.facades.items():
        room = join.anatomy.rooms[zone]
        join.air_to(room, value, join.graph.boundary("outdoor"), area)


def _build_opening(join: Joining) -> None:
    rate, heat = join.parameter("window_opening_rate"), join.anatomy.air_heat_capacity
    for room in _exposed(join):
        varying = Signal(f"open windows of {room.name}", "K", partial(_by_opening, zone=room.name))
        join.heat_air(room, rate, varying, heat * room.volume / 3600.0)
        seen = Signal(f"windows seen open in {room.name}", "K*m/s", partial(_by_hand, zone=room.name))
        join.heat_air(room, join.parameter("opened_window_area", zone=room.name), seen, heat)


def _build_mixing(join: Joining) -> None:
    heat, inside = join.anatomy.air_heat_capacity, {room.name for room in join.rooms}
    for first, second in join.anatomy.partitions:
        if not {first, second} <= inside:
            continue
        a, b, pair = join.anatomy.rooms[first], join.anatomy.rooms[second], f"{first}{PAIR}{second}"
        constant, scheduled = (join.parameter(n, zone=pair) for n in ("door_airflow", "occupied_door_airflow"))
        near, far, share = paired((a.air, a.share), (b.air, b.share))
        join.graph.face(f"zone_mixing {pair}", constant + _PRESENCE * scheduled, near, far, heat * share)
        signal = Signal(f"presence and difference {pair}", "K", partial(_by_presence, first=first, second=second))
        join.heat_air(a, scheduled, signal, heat)
        join.heat_air(b, scheduled, signal, -heat)


def _no_partitions(anatomy: Anatomy) -> str | None:
    return None if anatomy.partitions else "no two zones share a partition"


INFILTRATION = Effect(
    id="infiltration",
    title="outdoor air that leaks in",
    equation="ρ c V (n + n_w v + n_s |ΔT|^½) (T_out - T)",
    source=_SHERMAN,
    acts_on="air of the zones with exterior walls",
    confounders=("thermal_bridge", "wind_film", "window_opening"),
    separated_by="CO2 or tracer gas; windy and calm nights; seasons",
    parameters=(
        strength("infiltration_rate", "1/h", 1.0, "0.05 to 1: ASHRAE Fundamentals 2017, ch. 16", "infiltration"),
        strength("infiltration_by_wind", "s/m/h", 0.2, _SHERMAN, "infiltration"),
        strength("infiltration_by_stack", "1/h/K^0.5", 0.15, _SHERMAN, "infiltration"),
    ),
    build=_build_infiltration,
    applies=without_facades,
)

THERMAL_BRIDGE = Effect(
    id="thermal_bridge",
    title="thermal bridges and windows worse than rated",
    equation="ΔU A (T_out - T)",
    source="ISO 10211:2017; ISO 14683:2017 (default linear transmittances)",
    acts_on="air of the zones with exterior walls",
    confounders=("infiltration", "longwave_sky"),
    separated_by="blower door; windy and calm nights",
    parameters=(
        strength("thermal_bridge_u_value", "W/m^2/K", 1.0, "ISO 14683:2017: up to 1 W/m/K an edge", "thermal_bridge"),
    ),
    build=_build_bridge,
    applies=without_facades,
)

WINDOW_OPENING = Effect(
    id="window_opening",
    title="windows that people open",
    equation="ρ c (V n occ(t) m(T_out) + A_w o(t) ½ (0.001 v² + 0.0035 |ΔT| + 0.01)^½) (T_out - T), "
    "m from 0 at 12 to 1 at 22 degC, o when one is seen to stand open",
    source="Rijal et al. (2007), doi:10.1016/j.enbuild.2007.02.003 (opening rises with outdoor temperature); "
    "de Gids and Phaff (1982) (flow through one open window)",
    acts_on="air of the zones with exterior walls",
    confounders=("infiltration", "internal_gains", "capacity_limit"),
    separated_by="window contacts; mild and cold days",
    parameters=(
        strength("window_opening_rate", "1/h", 6.0, "single-sided ventilation: CIBSE AM10", "window_opening"),
        strength("opened_window_area", "m^2", 4.0, "a few casements: de Gids and Phaff (1982)", "window_opening"),
    ),
    build=_build_opening,
    zonal=True,
    applies=without_facades,
)

ZONE_MIXING = Effect(
    id="zone_mixing",
    title="air exchanged between zones",
    equation="ρ c (V̇ + V̇_occ occ(t)) (T_j - T_i)",
    source="Allard and Utsumi (1992), Energy and Buildings 18, 133-145 (open doors)",
    acts_on="air of zones that share a partition",
    confounders=("interior_wall_conductivity",),
    separated_by="door contacts; unequal set-points",
    parameters=(
        strength("door_airflow", "m^3/s", 0.3, "0.02 to 0.3 a door: Allard and Utsumi (1992)", "zone_mixing"),
        strength("occupied_door_airflow", "m^3/s", 0.3, "doors open while people are there", "zone_mixing"),
    ),
    build=_build_mixing,
    zonal=True,
    applies=_no_partitions,
)
