"""What sensors, meters and terminals get wrong: bias, lag, flow gain, duct loss, limits and leaks."""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, Effect, Joining, hat, shape, strength
from thermal.inputs.drivers import Drivers, Signal
from thermal.units import AIR_HEAT_CAPACITY

#: Heat that a sensor takes up in a minute over that of the zone's air [-]: too little to cool the zone, and enough for
#: a reduced model to see.
_SENSOR = 1e-4

#: NTU at which the loss of a duct is linearised [-].
_NTU = 0.1

#: Shares of capacity that may be lost [-]: knots of the interpolation in between.
_LOST = (0.0, 0.1, 0.2, 0.35, 0.5, 0.7)


def _flow(drivers: Drivers, zone: str) -> FloatArray:
    return np.asarray(AIR_HEAT_CAPACITY * drivers.supply[0][:, drivers.zones.index(zone)])


def _passing(drivers: Drivers, number: int) -> FloatArray:
    return np.asarray(AIR_HEAT_CAPACITY * drivers.airflow[:, number])


def _heat(drivers: Drivers, zone: str) -> FloatArray:
    return np.asarray(drivers.heat[:, drivers.zones.index(zone)])


def _duct(drivers: Drivers, zone: str, exponent: float) -> FloatArray:
    """Heat lost per unit of NTU at the largest flow; NTU grows as flow falls, to a power."""
    k = drivers.zones.index(zone)
    flow, heat = (v[:, k] for v in drivers.supply)
    most = float(np.quantile(flow, 0.99))
    running = flow > 1e-3 * max(most, 1e-9)
    ntu = _NTU * (most / np.where(running, flow, 1.0)) ** exponent
    return np.where(running, heat * -np.expm1(-ntu) / _NTU, 0.0)


def _over(drivers: Drivers, zone: str, lost: float) -> FloatArray:
    heat = _heat(drivers, zone)
    limit = (1.0 - lost) * float(np.quantile(np.abs(heat), 0.99))
    return np.asarray(np.sign(heat) * np.maximum(np.abs(heat) - limit, 0.0))


def _running(drivers: Drivers, zone: str) -> FloatArray:
    flow = drivers.supply[0][:, drivers.zones.index(zone)]
    return (flow > 0.02 * max(float(flow.max()), 1e-9)).astype(float)


def _build_bias(join: Joining) -> None:
    for room in join.rooms:
        bias = join.parameter("sensor_bias", zone=room.name)
        inside = np.append(room.air, room.mean) if room.mean >= 0 else room.air
        for value, near, far, weight in join.graph.touching(np.unique(inside)):
            join.graph.source(join.key(room.name), bias * value, near, CONSTANT, weight)
            beyond = far >= 0
            if beyond.any():
                join.graph.source(join.key(room.name), -bias * value, far[beyond], CONSTANT, weight[beyond])
        join.heat_air(room, bias, Signal(f"supply air of {room.name}", "W/K", partial(_flow, zone=room.name)), 1.0)
        for number, (source, target) in enumerate(join.anatomy.airflows):
            # air that passes from zone to zone brings what its sensors make of it, and not the bias
            if room.number in (source, target):
                entered = join.anatomy.rooms[join.graph.zones[target]]
                signal = Signal(f"passing air {number}", "W/K", partial(_passing, number=number))
                join.heat_air(entered, bias if room.number == target else -bias, signal, 1.0)


def _build_lag(join: Joining) -> None:
    lag, link = join.parameter("sensor_lag"), ca.SX(_SENSOR / 60.0)
    for room in join.rooms:
        node, heat = join.graph.volumes("sensor", room.number), join.anatomy.air_heat_capacity * room.volume
        join.graph.capacity("sensor", lag * _SENSOR, node, heat)
        join.air_to(room, link, int(node[0]), heat)
        join.graph.reading(room.number, int(node[0]))


def _build_gain(join: Joining) -> None:
    for room in join.rooms:
        signal = Signal(f"heat of {room.name}", "W", partial(_heat, zone=room.name))
        join.heat_air(room, join.parameter("flow_gain", zone=room.name), signal, 1.0)


def _build_duct(join: Joining) -> None:
    by_flow = join.parameter("duct_flow_dependence")
    for room in join.rooms:
        lost = join.parameter("duct_ntu", zone=room.name)
        for share, exponent in ((1.0 - by_flow, 0.0), (by_flow, 1.0)):
            signal = Signal(
                f"heat in the ducts of {room.name}, flow to the power {exponent:g}", "W",
                partial(_duct, zone=room.name, exponent=exponent),
            )  # fmt: skip
            join.heat_air(room, -lost * share, signal, 1.0)


def _build_limit(join: Joining) -> None:
    for room in join.rooms:
        lost = join.parameter("capacity_lost", zone=room.name)
        for number, knot in enumerate(_LOST[1:], 1):
            signal = Signal(
                f"heat of {room.name} over {1.0 - knot:.0%}", "W", partial(_over, zone=room.name, lost=knot)
            )
            join.heat_air(room, -hat(lost, _LOST, number, signed=True), signal, 1.0)


def _build_leak(join: Joining) -> None:
    for room in join.rooms:
        signal = Signal(f"air flows into {room.name}", "1", partial(_running, zone=room.name))
        join.heat_air(room, join.parameter("valve_leak", zone=room.name), signal, room.floor_area)


SENSOR_BIAS = Effect(
    id="sensor_bias",
    title="a zone sensor that reads wrong",
    equation="y = T + b; the metered heat follows, q + ρ c V̇ b",
    source="offsets of wall sensors up to 1.5 K: ASHRAE Guideline 36 fault thresholds",
    acts_on="what the zone's sensor and its heat meter say",
    confounders=("internal_gains", "ground_exchange", "flow_gain"),
    separated_by="free-floating nights; a second sensor",
    parameters=(strength("sensor_bias", "K", 1.5, "plus or minus 1.5 K", "sensor_bias", -1.5),),
    build=_build_bias,
    zonal=True,
)

SENSOR_LAG = Effect(
    id="sensor_lag",
    title="zone sensors that lag behind",
    equation="τ dT_s/dt = T - T_s",
    source="wall sensors 2 to 15 min: ISO 7726:1998 Annex",
    acts_on="what the zones' sensors say",
    confounders=("hidden_mass", "clock_shift"),
    separated_by="steps of heat",
    parameters=(strength("sensor_lag", "min", 15.0, "2 to 15 min", "sensor_lag"),),
    build=_build_lag,
)

FLOW_GAIN = Effect(
    id="flow_gain",
    title="a heat meter that reads wrong",
    equation="ε q",
    source="flow stations within 30 %: ASHRAE 111",
    acts_on="air of the zones concerned",
    confounders=("duct_loss", "hidden_mass", "capacity_limit"),
    separated_by="a known heater; when all meters read alike, nothing but that",
    parameters=(strength("flow_gain", "1", 0.3, "plus or minus 30 %", "flow_gain", -0.3),),
    build=_build_gain,
    zonal=True,
)

DUCT_LOSS = Effect(
    id="duct_loss",
    title="heat lost from ducts",
    equation="-(1 - e^-NTU) ṁ c (T_d - T), NTU between constant and falling with flow",
    source="ASHRAE 152-2014 (duct losses): NTU falls with flow where the film outside of the duct governs",
    acts_on="air of the zones concerned",
    confounders=("flow_gain", "hidden_mass"),
    separated_by="low and high flow at equal heat",
    parameters=(
        strength("duct_ntu", "1", 0.3, "0.02 to 0.3", "duct_loss"),
        shape("duct_flow_dependence", "1", 0.3, 0.02, 0.98, "any share of the two laws", "duct_loss", "logit"),
    ),
    build=_build_duct,
    zonal=True,
)

CAPACITY_LIMIT = Effect(
    id="capacity_limit",
    title="a terminal that gives less than it says",
    equation="min(|q|, (1 - δ) q_max) - |q|",
    source="stuck dampers and undersized coils: ASHRAE Guideline 36, 5.1",
    acts_on="air of the zones concerned",
    confounders=("flow_gain", "window_opening"),
    separated_by="hours at full load with windows shut",
    parameters=(strength("capacity_lost", "1", 0.7, "0 to 70 %", "capacity_limit"),),
    build=_build_limit,
    zonal=True,
)

VALVE_LEAK = Effect(
    id="valve_leak",
    title="a heating valve that leaks",
    equation="Q_l 1[air flows]",
    source="leaking valves: Katipamula and Brambley (2005), doi:10.1080/10789669.2005.10391133",
    acts_on="air of the zones concerned",
    confounders=("internal_gains", "sensor_bias"),
    separated_by="valve closed with the fan on",
    parameters=(strength("valve_leak", "W/m^2", 20.0, "up to a third of a coil", "valve_leak"),),
    build=_build_leak,
    zonal=True,
)
