"""Described plants as sites: what BACnet shows is the plant's, a write reaches it, and given back it is its own again."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import yaml

from mpc.errors import LiveError, PlantError
from mpc.live.audit import AuditLog
from mpc.live.clock import set_clock
from mpc.live.links.make import make_links
from mpc.live.outlook import Outlook
from mpc.live.past import recent_past
from mpc.live.planner import Planner, forecast_to_dict, needed_columns
from mpc.live.site import Site
from mpc.scenario.forecast import Forecast

PATIENCE = 30.0  # s
Make = Callable[..., Any]


@pytest.fixture
def make_site(script: Callable[[str], ModuleType], tmp_path: Path) -> Iterator[Make]:
    """Make sites of plants whose clock hardly runs: it is set where a step is to be taken."""
    pytest.importorskip("rusty_bacnet", reason="needs a BACnet device of another stack: pip install rusty-bacnet")
    pytest.importorskip("bacpypes3", reason="needs the extra [live]")
    made: list[Any] = []
    for name in ("_bacnet_device", "_site_files"):
        script(name)

    def make(plant: Path) -> tuple[Any, Site]:
        made.append(script("_plant_site").PlantSite.described(plant, tmp_path / "site", 1.001))
        return made[-1], Site(made[-1].begin("postgresql:///none"))

    yield make
    for site in made:
        site.stop()


def step(device: Any, site: Site) -> Mapping[str, float]:
    """Let the plant take a step of its own."""
    before = device.time
    time.sleep(0.1)  # a few looks, so that what was written is seen
    set_clock(site.folder / "clock.json", before + device.step)
    end = time.monotonic() + PATIENCE
    while device.time == before and time.monotonic() < end:
        time.sleep(0.005)
    assert device.time == before + device.step
    return dict(device.seen)


def operated(device: Any, site: Site, point: str, value: float) -> tuple[float, float, float]:
    """What a point measures under the plant's own control, while it is written to, and given back; shown is what is."""

    async def work() -> list[Mapping[str, float]]:
        link = make_links(site)["hall"]
        await link.open()
        try:
            found = []
            for written in (None, value, None):
                assert await link.write(point, written) == ""
                found.append(await asyncio.to_thread(step, device, site))
                told = await link.read(site.file.points, slots=False)
                assert not [name for name, one in told.items() if one["error"]]
                shown = {name: one["value"] for name, one in told.items() if name in found[-1]}
                assert len(shown) == len(found[-1])
                np.testing.assert_allclose([*shown.values()], [found[-1][n] for n in shown], rtol=1e-6, atol=1e-6)
            return found
        finally:
            await link.close()

    return tuple(seen[point] for seen in asyncio.run(work()))


def check_plan(device: Any, site: Site) -> None:
    """The forecasts that are written are the plant's, and the rule plans on them."""
    outlook = Outlook(site.plant_path, site.plant).at(device.time)
    expected, found = device.plant.forecast().table, outlook.table
    assert len(found) == round(site.plant.forecast.hours * 3600.0 / site.step)
    parts = round(site.step / (expected.index[1] - expected.index[0]).total_seconds())
    for column in ("electricity_price", "outside_air_temperature_sensor", *(c for c in found if "comfort" in c)):
        means = expected[column].to_numpy()[: parts * len(found)].reshape(-1, parts).mean(axis=1)
        np.testing.assert_allclose(found[column], means, atol=0.2 if "sensor" in column else 1e-6, err_msg=column)
    inputs = {"begin": device.time, "means": dict(device.seen), "forecast": forecast_to_dict(outlook), "trouble": ""}
    plan = Planner(site).plan(inputs)
    assert plan["status"] == "planned" and plan["values"]


def test_a_test_case_of_a_boptest_server_is_a_site(make_site: Make, tmp_path: Path) -> None:
    from mpc.adapters.boptest.make import pilot_to_serve
    from mpc.adapters.boptest.server import BoptestServer

    served = pilot_to_serve(1, floor_area=100.0, zones=2, floors=1, dx=2.0, days=4.0, name="small")
    zones, water = served.building.zone_names, "BOILER/supply_water_temperature_setpoint"
    with BoptestServer([served]) as server:
        plant = {
            "format": 1, "name": "small", "plant": {"kind": "boptest", "url": server.url}, "control_step": 900.0,
            "location": {"latitude": 37.4, "longitude": -122.1, "elevation": 20.0, "timezone": "Etc/GMT+8"},
            "period": {"start": "2023-01-02 07:00", "days": 1, "warm_up_days": 0.25},
            "zones": {zone: {"temperature": f"reaTZon_{zone}_y", "floor_area": 50.0,
                             "comfort": {"lower": f"LowerSetp[{zone}]", "upper": f"UpperSetp[{zone}]"},
                             "people": f"Occupancy[{zone}]"} for zone in zones},
            "measurements": {name: f"{name.replace('/', '_')}_y"
                             for name in (water, "weather_station/outside_air_temperature_sensor")},
            "actuators": {name: f"{name.replace('/', '_')}_u"
                          for name in (water, f"{zones[0]}/zone_air_heating_temperature_setpoint")},
            "prices": {"electricity": "PriceElectricPowerDynamic"}, "forecast": {"hours": 6.0},
        }  # fmt: skip
        (tmp_path / "plant.yaml").write_text(yaml.safe_dump(plant))
        device, site = make_site(tmp_path / "plant.yaml")
        assert device.step == 300.0 and set(site.writable) == set(plant["actuators"])
        check_plan(device, site)
        assert operated(device, site, water, 345.0) == pytest.approx((333.15, 345.0, 333.15))
        check_plan(device, site)  # a control step later, on tables that have gone on
        device.stop()  # frees the test while the server is there


@pytest.mark.energyplus
def test_a_model_of_energyplus_is_a_site(
    make_site: Make, script: Callable[[str], ModuleType], package: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    pytest.importorskip("pyenergyplus", reason="needs the extra [energyplus]")
    package("energyplus_trials.frame")  # a neighbour that the plants are made with
    device, site = make_site(package("foreign_models.plants").write_plant("house", tmp_path))
    assert site.file.points["floor/pump"].at == "binary-value,2"
    check_plan(device, site)
    setpoint = "house/zone_air_heating_temperature_setpoint"
    assert operated(device, site, setpoint, 296.15) == pytest.approx((294.45, 296.15, 294.45))
    check_plan(device, site)
    path = tmp_path / "house" / "plant.yaml"
    with pytest.raises(LiveError, match="a folder without an earlier run"):
        make_site(path)
    plant_site = script("_plant_site").PlantSite.described
    with pytest.raises(LiveError, match="rate: expected more than 1"):
        plant_site(path, tmp_path / "other", 1.0)
    told = yaml.safe_load(path.read_text())
    del told["actuators"]["floor/pump"]["range"]
    path.write_text(yaml.safe_dump(told))
    with pytest.raises(PlantError, match=r"actuators.floor/pump.range: expected a lowest"):
        plant_site(path, tmp_path / "other", 60.0)


def test_what_a_device_is_told_becomes_a_value_of_the_actuator(script: Callable[[str], ModuleType]) -> None:
    from mpc.loop.actuators import Actuator

    for name in ("_bacnet_device", "_site_files"):
        script(name)
    taken = script("_plant_site")._taken
    plain = Actuator("a/b", "K", 285.15, 303.15)
    assert [taken(plain, value) for value in (float("nan"), 280.0, 290.0, 303.150001)] == [285.15, 285.15, 290.0, 303.15]
    speed = Actuator("a/b", "1", 0.0, 1.0, kind="modulating", minimum=0.25)
    assert [taken(speed, value) for value in (-1.0, 0.1, 0.2, 0.6, 2.0)] == [0.0, 0.0, 0.25, 0.6, 1.0]
    switch = Actuator("a/b", "1", 0.0, 1.0, kind="on_off")
    assert [taken(switch, value) for value in (0.4, 0.6, 7.0)] == [0.0, 1.0, 1.0]


@pytest.mark.long
def test_an_office_with_air_handlers_is_a_site_and_is_planned_by_its_building(
    office_site: Callable[[float], Any], tmp_path: Path
) -> None:
    device, plant, path = office_site(0.2)
    try:
        site = Site(path)
        check_plan(device, site)
        outlook = Outlook(site.plant_path, site.plant).at(device.time)
        gains = [column for column in outlook.table if column.endswith("/internal_gain")]
        # lights and equipment beside people
        np.testing.assert_allclose(outlook.table[gains], plant.forecast().table[gains][: len(outlook.table)], rtol=1e-9)
        planner = Planner(site)
        inputs = {"begin": device.time, "means": dict(device.seen), "forecast": forecast_to_dict(outlook), "trouble": ""}
        plan = planner.plan(inputs)
        assert plan["status"] == "planned" and set(plan["values"]) == set(site.writable) == set(plant.own)
        assert len(plan["ahead"]["zone"]) == 49 and len(plan["ahead"]["zone"][0]) == 4
        assert plan["ahead"]["rule"]["rule"] > plan["ahead"]["rule"]["plan"] > 0.0  # at night 75 degC are a waste
        assert Planner(site).plan(inputs) == plan
        without = Forecast(outlook.table[["outside_air_temperature_sensor"]])
        lost = planner.plan(inputs | {"forecast": forecast_to_dict(without)})
        assert lost["values"] == {} and lost["status"].startswith("no plan: forecast lacks 'electricity_price'")

        log = AuditLog(site.folder, "controller", dict)
        going, fresh, again = (Planner(site) for _ in range(3))
        for _ in range(12):
            made = going.plan(inputs)
            assert made["status"] == "planned"
            log.append("plan", {"inputs": inputs, "plan": made})
            for _ in range(round(site.step / device.step)):
                step(device, site)
            outlook = Outlook(site.plant_path, site.plant).at(device.time)
            inputs |= {"begin": device.time, "means": dict(device.seen), "forecast": forecast_to_dict(outlook)}
        log.close()
        again.start_up(recent_past(site.folder, device.time, needed_columns(site, again.controller)), device.time)
        states = []
        for one in (going, fresh, again):
            one.plan(inputs)
            states.append(one.controller.controller.observer.modal_state)
        apart = [float(np.linalg.norm(state - states[0])) for state in states[1:]]
        assert apart[1] < 1e-9 * apart[0]  # its walls are as warm as those of the one that went on

        water = "BOILER/supply_water_temperature_setpoint"
        seen = operated(device, site, water, 330.0)
        assert seen == pytest.approx((348.15, 330.0, 348.15))

        told = yaml.safe_load(path.read_text())
        told["model"]["own_control"]["cold"] = "20 degC"
        path.write_text(yaml.safe_dump(told))
        with pytest.raises(LiveError, match=r"model.own_control: .*colder than the warm one"):
            Site(path)
        flow = next(point for point in told["points"] if point.endswith("/supply_air_flowrate_sensor"))
        del told["model"]["own_control"]["cold"], told["points"][flow]
        path.write_text(yaml.safe_dump(told))
        with pytest.raises(LiveError, match=f"points: expected all that .* none of {flow}"):
            Planner(Site(path))
        before, plans = Site(path).hash, (tmp_path / "case" / "building.yaml").read_text()
        (tmp_path / "case" / "building.yaml").write_text(plans + "\n# drawn again\n")
        assert Site(path).hash != before
    finally:
        device.stop()
