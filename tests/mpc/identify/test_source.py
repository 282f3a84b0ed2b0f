"""What one source buys for all its terminals: when it is found, its lines, its sums, and plans by its tangents."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from calibration.grey_box.network import GreyBox
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import WEIGHTS
from mpc.control.identified.controller import IdentifiedController
from mpc.control.identified.electric import Electric, ElectricNow
from mpc.errors import ControlError, PlantError
from mpc.identify.curves import EMITTER, Curve
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap, map_machines
from mpc.identify.model import PlantModel
from mpc.identify.regression import Loads, design_of, left_out_error
from mpc.identify.source import Source, find_source
from mpc.identify.telemetry import CARRIERS
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from thermal.case.building import Location

FULL, DAYS, ROOMS = 8e3, 14, ("north", "east", "south", "west")
N = 96 * DAYS
MACHINES = [
    Machine(Actuator(f"{room}/{HEATING_SETPOINT}", "K", 285.15, 298.15), "setpoint", (room,), f"{room}/heat")
    for room in ROOMS
]


def _loads(seed: int) -> Loads:
    """Terminals that want heat for some hours, each at its own times."""
    rng = np.random.default_rng(seed)
    level = np.repeat(rng.uniform(0.0, 1.0, (N // 8, 4)) * (rng.uniform(size=(N // 8, 4)) < 0.5), 8, axis=0)
    return Loads(level, 275.0 + np.repeat(rng.normal(0.0, 5.0, DAYS), 96), np.full((N, 4), EMITTER))


def _found(loads: Loads, power: np.ndarray, own: bool = False) -> tuple[Source | None, dict[str, float]]:
    noise = np.random.default_rng(9).normal(0.0, 100.0, N)
    bought = {"electricity": power + noise}
    maps, _ = map_machines(MACHINES, loads, FULL * loads.level, bought, np.full((N, 4), np.nan), 96)
    if own:
        maps = tuple(replace(m, machine=replace(m.machine, power=f"{m.machine.name}/power")) for m in maps)
    return find_source(loads, bought, maps, 96)


def _heat_pump(load: np.ndarray, outdoor: np.ndarray) -> np.ndarray:
    """Electricity of one that modulates down to a quarter of its load, below which it switches on and off [W]."""
    on = np.minimum(load / 0.25, 1.0)
    return (1500.0 * on + 9000.0 * load) * (1.0 - 0.02 * (outdoor - 280.15))


def test_a_heat_pump_is_found_behind_its_terminals() -> None:
    loads = _loads(0)
    source, base = _found(loads, 300.0 + _heat_pump(loads.level.mean(axis=1), loads.outdoor))
    assert source is not None and 0.5 < source.full < 0.7
    for outdoor in (270.0, 280.0):
        load = np.array([0.15, 0.3, 0.5, source.full])
        said, true = base["electricity"] + source.at(load, outdoor)[:, 0], 300.0 + _heat_pump(load, outdoor)
        assert said == pytest.approx(true, rel=0.01)
    assert source.least == 0.25 and source.dearer > 1.08 and base["electricity"] == pytest.approx(300.0, abs=20.0)


def _each(loads: Loads) -> np.ndarray:
    return np.asarray(sum(0.25 * _heat_pump(u, loads.outdoor) for u in loads.level.T))


@pytest.mark.parametrize(
    ("power", "own"),
    [
        (lambda loads: FULL * loads.level.sum(axis=1), False),  # electric baseboards
        (_each, False),  # a heat pump for each room
        (lambda loads: FULL * loads.level @ [0.2, 1.0, 0.3, 0.9], False),  # machines of all kinds
        (lambda loads: _heat_pump(loads.level.mean(axis=1), loads.outdoor), True),  # with sensors of their own
    ],
)
def test_machines_of_their_own_are_none(power, own: bool) -> None:
    loads = _loads(1)
    assert _found(loads, power(loads), own) == (None, {})


def test_a_source_that_is_told_is_taken_where_telemetry_does_not_refuse_it() -> None:
    """Rooms that move together, which cannot tell one heat pump from one for each; baseboards are none all the same."""
    loads = _loads(3)
    rng = np.random.default_rng(8)
    same = np.clip(loads.level.mean(axis=1)[:, None] + rng.normal(0.0, 0.02, (N, 4)), 0.0, 1.0)
    alike = Loads(same, loads.outdoor, loads.emitter)
    bought = {"electricity": 300.0 + _heat_pump(same.mean(axis=1), loads.outdoor) + rng.normal(0.0, 400.0, N)}
    maps, _ = map_machines(MACHINES, alike, FULL * same, bought, np.full((N, 4), np.nan), 96)
    assert find_source(alike, bought, maps, 96) == (None, {})
    source, _ = find_source(alike, bought, maps, 96, told=True)
    assert source is not None and 0.15 <= source.least <= 0.4 and source.dearer > 1.05
    heaters = {"electricity": FULL * loads.level @ [0.2, 1.0, 0.3, 0.9] + rng.normal(0.0, 100.0, N)}
    maps, _ = map_machines(MACHINES, loads, FULL * loads.level, heaters, np.full((N, 4), np.nan), 96)
    assert find_source(loads, heaters, maps, 96, told=True) == (None, {})


def test_a_source_as_good_at_part_load_is_none() -> None:
    """A boiler whose left-out days the total tells much better: by what it buys at half load it needs no map."""
    loads = _loads(2)
    load = loads.level.mean(axis=1)
    rising = FULL * (2.0 * load + 3.0 * load**2)
    designs = [design_of(Loads(load[:, None], loads.outdoor, loads.emitter[:, :1]), [0]), design_of(loads, range(4))]
    errors = [left_out_error(design, rising, 96) for design in designs]
    assert errors[0] < 0.1 * errors[1] and _found(loads, rising) == (None, {})


@pytest.mark.parametrize("seed", range(3))
def test_rooms_that_move_together_beside_metered_lights_are_none(seed: int) -> None:
    """Baseboards that weather and a morning's boost lead alike, in ten rooms, lights on the same meter."""
    rng, rooms, days = np.random.default_rng(seed), 10, 7
    n = 96 * days
    hour = np.arange(n) % 96 / 4.0
    outdoor = 275.0 + np.repeat(rng.normal(0.0, 4.0, days), 96) + 3.0 * np.sin(2.0 * np.pi * (hour - 9.0) / 24.0)
    same = 0.3 + 0.02 * (275.0 - outdoor) + 0.4 * ((hour >= 6.0) & (hour < 8.0))
    level = np.clip(same[:, None] + rng.normal(0.0, 0.05, (n, rooms)), 0.0, 1.2)
    loads = Loads(level, outdoor, np.full((n, rooms), EMITTER))
    lights = 2000.0 * ((hour >= 8.0) & (hour < 18.0))
    machines = [
        Machine(Actuator(f"r{k}/{HEATING_SETPOINT}", "K", 285.0, 298.0), "setpoint", (f"r{k}",), f"r{k}/heat")
        for k in range(rooms)
    ]
    bought = {"electricity": 1500.0 * level.sum(axis=1) + lights + rng.normal(0.0, 50.0, n)}
    maps, _ = map_machines(machines, loads, 1500.0 * level, bought, np.full((n, rooms), np.nan), 96)
    assert find_source(loads, bought, maps, 96) == (None, {})


def _source() -> Source:
    terms = {"command": 6e3, "standing": 2.5e3, "outdoor": -2e3, "standing outdoor": 0.2e3}
    return Source({"electricity": Curve(terms, dict.fromkeys(terms, 0.0))}, 0.7, 0.15)


def test_lines_touch_where_planned_and_lie_nowhere_below() -> None:
    source, most = _source(), np.full(5, np.inf)
    outdoor, planned = np.linspace(258.0, 290.0, 5), np.array([0.0, 0.1, 0.4, 0.7, 0.9])
    at_none, by_load = source.lines(outdoor, most, planned)
    share, slope = source.lines(outdoor, most)
    assert not share.any()
    for load in np.linspace(0.0, 1.2, 25):
        power = source.at(np.full(5, load), outdoor)
        assert (at_none + by_load * load >= power - 1e-6).all()
        assert load > source.full or (slope * load <= power + 1e-6).all()
    np.testing.assert_allclose(at_none + by_load * planned[:, None], source.at(planned, outdoor))
    more, less = (source.at(planned + d, outdoor) for d in (1e-4, -1e-4))
    np.testing.assert_allclose(by_load[1:], ((more - less) / 2e-4)[1:], rtol=1e-6)
    assert by_load[1, 0] > by_load[2, 0]  # while it goes on and off its standing power is the price of heat, too
    held = source.lines(outdoor, np.full(5, 0.4))[1]
    np.testing.assert_allclose(held * 0.4, source.at(np.full(5, 0.4), outdoor))  # full load is what there is


@pytest.mark.parametrize("terms", [(-2e3, 9e3, 0.0, 0.0), (5e3, 1e3, 0.0, 2e3), (5e3, -1e3, -9e3, 0.0)])
def test_power_is_held_concave_and_rising_in_any_weather(terms: tuple[float, ...]) -> None:
    """Whatever a regression says of weather that it has not seen."""
    curve = Curve(dict(zip(("command", "standing", "outdoor", "standing outdoor"), terms, strict=True)), {})
    source, load = Source({"gas": curve}, 0.7, 0.2), np.linspace(0.0, 1.2, 61)
    power = source.at(load, 270.15)[:, CARRIERS.index("gas")]
    assert (np.diff(power) >= -1e-9).all() and (np.diff(power, 2) <= 1e-9).all() and power[0] == 0.0
    for planned in (0.0, 0.1, 0.5, 1.0):
        outdoor = np.full(61, 270.15)
        at_none, by_load = source.lines(outdoor, np.full(61, np.inf), np.full(61, planned))
        assert (at_none[:, 1] + by_load[:, 1] * load >= power - 1e-6).all() and not by_load[:, 0].any()


def test_a_source_that_is_none_is_refused() -> None:
    with pytest.raises(PlantError, match="full: expected a load above 0, found 0"):
        Source({}, 0.0, 0.2)
    with pytest.raises(PlantError, match="least: expected a load above 0, found 0"):
        Source({}, 0.5, 0.0)
    with pytest.raises(PlantError, match="oil"):
        Source({"oil": Curve({}, {})}, 0.5, 0.2)
    content = _office(_source()).to_dict()
    content["source"]["full"] = -1.0
    with pytest.raises(ControlError, match="a load above 0"):
        PlantModel.from_dict(content)


def _office(source: Source | None) -> PlantModel:
    heat, per_load = Curve({"command": FULL}, {"command": 0.0}), Curve({"command": 2700.0}, {"command": 0.0})
    powers = {} if source is not None else {"electricity": per_load}
    maps = tuple(MachineMap(machine, "setpoint", heat, powers, (-0.1, 0.3)) for machine in MACHINES)
    serves = {m.name: m.serves for m in MACHINES}
    box = GreyBox.start(dict.fromkeys(ROOMS, 120.0), (), serves, (True,) * 4)
    return PlantModel("office", 900.0, box, maps, {"electricity": 300.0}, (), source)


def test_what_it_buys_is_shared_out_by_load_and_survives_a_file() -> None:
    model = _office(_source())
    levels = np.random.default_rng(3).uniform(0.0, 1.1, (6, 4)) * np.array([1.0, 1.0, 0.0, 1.0])
    levels[0] = 0.0
    outdoor = np.linspace(260.0, 285.0, 6)
    bought = model.bought(np.zeros((6, 16)), levels, outdoor)
    np.testing.assert_allclose(bought.sum(axis=1), model.source.at(levels.mean(axis=1), outdoor))
    assert not bought[0].any() and not bought[:, 2].any() and (bought[1:, 0, 0] > 0.0).all()
    again = PlantModel.from_dict(model.to_dict())
    assert again.to_dict() == model.to_dict() and again.source == model.source
    assert PlantModel.from_dict(_office(None).to_dict()).source is None


def _ahead(n: int, edge: float = 293.15) -> Ahead:
    lower = np.full((n, 4), edge)
    rng = np.random.default_rng(2)
    price = np.repeat(rng.uniform(0.1, 0.4, (n // 4, 1)), 4, axis=0) * np.ones((1, 3))
    return Ahead(np.full(n, 271.15), np.zeros((n, 0)), np.zeros((n, 4)), price, lower, lower + 5.0, lower > 0.0,
                 np.zeros((n, 4, WEIGHTS)), np.full(n, np.inf),
                 np.zeros(n, dtype=int), np.zeros(n))  # fmt: skip


def _controller(model: PlantModel, electric: Electric | None = None) -> IdentifiedController:
    place = Location(latitude=50.0, longitude=5.0, elevation=0.0, timezone="Etc/GMT-1")
    made = IdentifiedController(model, tuple(m.actuator for m in MACHINES), place, electric=electric)
    made._kept = np.zeros((48, 4))
    made._observer.state = np.concatenate([np.full(16, 0.5), np.zeros(4)])
    return made


def test_each_plan_is_no_worse_than_the_one_that_it_begins_from() -> None:
    """By the power itself; and it costs less than one that takes part load for as good as full load."""
    controller, ahead, ends = _controller(_office(_source())), _ahead(48), (np.zeros((48, 4)), np.ones((48, 4)))
    plans, before = [], None
    for _ in range(4):
        found = controller._solve_about(before, ahead, ends)
        assert found is not None and str(found.status) == "converged"
        before = found.decisions
        plans.append(controller._cost_of(found, ahead))
    assert plans[1] < 0.99 * plans[0]  # the first takes any load for as good as full load
    assert all(b <= a * (1.0 + 1e-6) for a, b in pairwise(plans))
    assert controller._solve(ahead, ends).cost == pytest.approx(plans[1], rel=1e-6)


def test_a_plan_of_a_limited_source_converges_within_it() -> None:
    """Where loads are counted in parts of what each has; a plan that begins from its own optimum stays there."""
    controller, n = _controller(_office(_source())), 48
    ahead = replace(_ahead(n, 292.15), together=np.full(n, 0.3))
    ends = np.zeros((n, 4)), np.full((n, 4), 1.1) * np.array([1.0, 1.0, 0.5, 1.0])
    found = controller._solve(ahead, ends)
    assert found.solver == "ipopt" and str(found.status) == "converged"
    assert found.decisions.mean(axis=1).max() == pytest.approx(0.3, abs=1e-4) and found.decisions[:, 2].max() <= 0.55
    again = controller._solve_about(found.decisions, ahead, ends)
    assert again.iterations < 40 and controller._cost_of(again, ahead) <= found.cost * (1.0 + 1e-6)


@pytest.mark.parametrize("kind", ["electricity", "gas"])
def test_what_is_bought_is_paid_at_its_own_price(kind: str) -> None:
    """Power of the source itself, by hand, where tangents touch; with a meter for electricity, too."""
    source = replace(_source(), powers={kind: _source().powers["electricity"]})
    model, n, levels = _office(source), 48, np.random.default_rng(5).uniform(0.0, 0.8, (48, 4))
    price = np.tile([0.3, 0.1, 0.0], (n, 1))
    ahead = replace(_ahead(n, 290.15), prices=price)
    plan = SimpleNamespace(decisions=levels, states=np.zeros((n + 1, 16)))
    power = source.at(levels.mean(axis=1), ahead.outdoor).sum(axis=1)
    expected = (power * price[:, CARRIERS.index(kind)]).sum() * 900.0 / 3.6e6
    even = 1e-4 * (levels**2).sum()
    assert _controller(model)._cost_of(plan, ahead) / 10.0 == pytest.approx(expected + even, rel=1e-9)
    with_meter = _controller(model, Electric(demand=1.0))
    data = with_meter._problem.data(
        np.concatenate([np.full(16, 0.5), np.zeros(4)]), ahead, np.zeros((n, 4)), 10.0,
        (np.zeros((n, 4)), np.ones((n, 4))), ElectricNow(np.zeros(n)), levels,
    )  # fmt: skip
    whole = np.column_stack([levels, np.zeros((n, with_meter._problem.decisions - 4))])
    after = with_meter._problem.stage.follow(data, whole)
    over = after[1:, 16]  # power that machines and all else take, of which nothing is bought here [kW]
    metered = power if kind == "electricity" else 0.0 * power
    np.testing.assert_allclose(over, (300.0 + metered) / 1e3, rtol=1e-9)
