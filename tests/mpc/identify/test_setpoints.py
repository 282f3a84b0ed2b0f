"""A thermostat that is led by its setpoint keeps the band, though the model is wrong."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from calibration.grey_box.network import GreyBox
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.identify.machines import Machine
from mpc.identify.maps import Curve, MachineMap
from mpc.identify.model import PlantModel
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE

NAME = f"room/{HEATING_SETPOINT}"


@pytest.mark.parametrize("back_off", [0.0, 0.2])
def test_a_setpoint_is_never_told_below_the_edge_of_the_band(back_off: float) -> None:
    thermostat = Actuator(NAME, "K", 285.15, 298.15)
    heat = Curve({"command": 5000.0}, {"command": 0.0})
    # it seems to give no heat until it is a kelvin above the air: what a wrong map says
    machine = MachineMap(
        Machine(thermostat, "setpoint", ("room",)), "setpoint", heat, {"electricity": heat}, (-1.0, 1.0)
    )
    box = GreyBox.start({"room": 100.0}, (), {NAME: ("room",)}, (False,))
    controller = IdentifiedController(
        PlantModel("shop", 900.0, box, (machine,)), (thermostat,), Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone="Etc/GMT-1"),
        IdentifiedSettings(back_off=back_off),
    )  # fmt: skip
    stamps = pd.date_range("2023-01-09 06:15", periods=48, freq="15min", tz="Etc/GMT-1")
    edges = np.where(np.arange(48) < 8, 288.15, 293.15)  # from 8 h on
    table = {OUTDOOR_TEMPERATURE: 273.15, "electricity_price": 0.2, "room/internal_gain": 0.0,
             "room/comfort_lower_temperature": edges, "room/comfort_upper_temperature": 297.15}  # fmt: skip
    forecast, layout = pd.DataFrame(table, index=stamps), PointLayout((f"room/{ZONE_TEMPERATURE}",), "Etc/GMT-1")
    told = []
    for k in range(16):
        air = 288.4 if k < 8 else 293.0
        seen = Measurements(layout, int(stamps[k].timestamp()) - 900, [air])
        told.append(controller.step(seen, Forecast(forecast.iloc[k : k + 24]))[NAME])
    assert (np.array(told) >= edges[:16] + back_off - 1e-9).all()
