"""What every library of predictive control can solve: ten zones of three states, twelve bilinear decisions.

Each zone has air with furniture, a slab and an exterior wall; zones stand in a ring. Decisions are the airflow to each
zone, the temperature of the supply air and that of the hot water, which warms it further on its way. Their products
are the heat of the zones: bilinear. Fans, a boiler whose distribution loses heat, and prices that change in the
morning are paid for; comfort is a band with a price outside of it. Zones differ: those of the south have three times
the gains. Temperatures are counted from 20 degC.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.linalg import expm

from mpc.control.solvers.stages import StageData, StageProblem

ZONES, STEPS, STEP, SEED = 10, 72, 300.0, 0
HEAT_CAPACITY = 1006.0  # J/kg/K, of air
DESIGN_FLOW = 3.5e-3  # kg/s/m2, of terminals
COMFORT_PRICE = 0.3  # currency/K/h
FLOW, TEMPERATURE = 0.1, 10.0  # units of the decisions [kg/s, K]
WATER = 40.0  # K: hot water is counted from here
PASSED_ON = 0.15  # of the difference between hot water and supply air that a terminal gives to the air


class Building(NamedTuple):
    """Exact step of the linear part: x' = transition x + drive [heat; gains; outdoor temperature]."""

    area: np.ndarray
    transition: np.ndarray
    drive: np.ndarray


def building() -> Building:
    """Draw the zones' areas and discretise."""
    area, n = np.random.default_rng(SEED).uniform(30.0, 80.0, ZONES), 3 * ZONES
    capacity = np.concatenate([2e4 * area, 2.5e5 * area, 1.5e5 * area])
    conductance, push = np.zeros((n, n)), np.zeros((n, 2 * ZONES + 1))

    def link(i: int, j: int, g: float) -> None:
        conductance[[i, j], [i, j]] += g
        conductance[[i, j], [j, i]] -= g

    for z in range(ZONES):
        link(z, ZONES + z, 6.0 * area[z])
        link(z, 2 * ZONES + z, 2.5 * area[z])
        link(z, (z + 1) % ZONES, 15.0)
        for node, g in ((z, 0.4 * area[z]), (2 * ZONES + z, 0.5 * area[z])):
            conductance[node, node] += g
            push[node, -1] += g
        push[z, [z, ZONES + z]] = 1.0
    whole = np.zeros((n + 2 * ZONES + 1,) * 2)
    whole[:n] = np.hstack([-conductance, push]) / capacity[:, None]
    step = expm(whole * STEP)
    return Building(area, step[:n, :n], step[:n, n:])


def common_problem() -> StageProblem:
    """Make the problem in stages."""
    area, transition, drive = building()
    x, u = ca.SX.sym("x", 3 * ZONES), ca.SX.sym("u", ZONES + 2)
    p = ca.SX.sym("p", ZONES + 3)  # gains, outdoor temperature, prices of electricity and gas
    flow, air, water = FLOW * u[:ZONES], TEMPERATURE * u[ZONES], WATER + TEMPERATURE * u[ZONES + 1]
    gains, outdoor, electricity, gas = p[:ZONES], p[ZONES], p[ZONES + 1], p[ZONES + 2]
    supplied = air + PASSED_ON * (water - air)
    heat = HEAT_CAPACITY * flow * (supplied - x[:ZONES])
    mixed = 0.7 * ca.sum1(x[:ZONES]) / ZONES + 0.3 * outdoor
    boiler = (HEAT_CAPACITY * ca.sum1(flow * (supplied - mixed)) + 60.0 * (water - 20.0)) / 0.85
    fans = 1500.0 * ca.sum1(flow**2 / (DESIGN_FLOW * area))
    least = np.concatenate([0.2 * DESIGN_FLOW * area / FLOW, [-0.6, -0.5]])
    most = np.concatenate([3.0 * DESIGN_FLOW * area / FLOW, [0.8, 3.5]])
    held = ca.dot(ca.DM(np.concatenate([2e4 * area, 2.5e5 * area, 1.5e5 * area])), x)
    return StageProblem(
        x, u, p, ca.mtimes(transition, x) + ca.mtimes(drive, ca.vertcat(heat, gains, outdoor)),
        (electricity * fans + gas * boiler) * STEP / 3.6e6 + 1e-4 * ca.sumsqr(u[ZONES:]),
        -0.04 * held / 3.6e6, x[:ZONES], least, most,
    )  # fmt: skip


def common_data(k: int, start: np.ndarray) -> StageData:
    """Make the horizon that begins k steps after 6:00."""
    area, hour = building().area, 6.0 + (k + np.arange(STEPS + 1)) * STEP / 3600.0
    occupied = (hour % 24 >= 7) & (hour % 24 < 19)
    south = np.where(np.arange(ZONES) < ZONES // 2, 3.0, 1.0)
    parameters = np.column_stack([
        np.where(occupied, 12.0, 1.0)[:-1, None] * area * south,
        -10.0 + 5.0 * np.sin(2.0 * np.pi * (hour[:-1] - 9.0) / 24.0),
        np.where(hour > 8.0, 0.25, 0.12)[:-1], np.where(hour > 9.0, 0.12, 0.08)[:-1],
    ])  # fmt: skip
    ones = np.ones(ZONES)
    lower, upper = (np.where(occupied, day, night)[:, None] * ones for day, night in ((1.0, -3.0), (4.0, 8.0)))
    lower[-1], upper[-1] = -50.0, 50.0  # a band counts at the start of a step, as do-mpc has it
    price = np.full((STEPS + 1, ZONES), COMFORT_PRICE * STEP / 3600.0)
    return StageData(start, parameters, lower, upper, price)
