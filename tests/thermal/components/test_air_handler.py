import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.air_handler import AirHandler
from thermal.components.component import Conditions
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.fan import Fan
from thermal.components.heater import Heater
from thermal.components.operations import FloatOperations
from thermal.components.streams import AirCommand, AirDrawn
from thermal.components.water_coil import WaterCoil
from thermal.errors import ModelError

OPS = FloatOperations()
HANDLER = AirHandler(Fan(2.0), Fan(2.0, 300.0, 100.0), CoolingCoil(40_000.0), WaterCoil.sized(15_000.0, 2.0))


def mix(handler=HANDLER, flow=1.5, returning=295.0, outdoor=280.0, setpoint=288.0, **more):
    rest = {"ventilation": 1.0} | more
    conditions = Conditions(None, None, None, outdoor, 0.004, 0.006)
    command = AirCommand(setpoint, 250.0, 1.0, **rest)
    return handler.mix(OPS, AirDrawn(flow, flow * returning), conditions, command, 1.0)


@pytest.mark.parametrize(
    ("outdoor", "share"),
    [(310.0, 0.2), (302.0, 0.2), (294.0, 1.0), (288.0, 1.0), (285.0, 0.7), (261.0, 7.0 / 34.0), (240.0, 0.2)],
)
def test_the_economiser_by_hand(outdoor, share):
    # return air 295 K, 288 K wanted: (295 - 288) / (295 - 285) = 0.7
    assert HANDLER.outdoor_share(OPS, 1.5, 295.0, outdoor, 288.0) == pytest.approx(share, abs=1e-9)


def test_limits_keep_the_economiser_at_its_minimum():
    locked = AirHandler(Fan(2.0), low_limit=283.0, high_limit=290.0, minimum_outdoor_share=0.3)
    shares = [locked.outdoor_share(OPS, 1.5, 295.0, t, 280.0) for t in (282.9, 284.0, 290.1)]
    assert shares == [0.3, 1.0, 0.3]
    damp = AirHandler(Fan(2.0), enthalpy_limit=40_000.0)
    assert damp.outdoor_share(OPS, 1.5, 298.0, 294.0, 286.0, 1.0, 0.012) == 0.2
    assert AirHandler(Fan(2.0), economizer=False).outdoor_share(OPS, 1.5, 295.0, 285.0, 288.0) == 0.2


def test_the_minimum_follows_a_flow_and_ventilation():
    handler = AirHandler(Fan(2.0), minimum_outdoor_share=0.0, minimum_outdoor_flow=0.5)
    assert handler.outdoor_share(OPS, 2.0, 295.0, 260.0, 300.0) == pytest.approx(0.25)
    assert handler.outdoor_share(OPS, 0.4, 295.0, 260.0, 300.0) == 1.0
    assert handler.outdoor_share(OPS, 2.0, 295.0, 260.0, 300.0, 0.0) == 0.0


@given(
    returning=st.floats(285.0, 303.0), outdoor=st.floats(250.0, 318.0), setpoint=st.floats(283.0, 300.0),
    flow=st.floats(0.05, 2.0), water=st.floats(293.0, 360.0),
)  # fmt: skip
def test_air_stays_between_what_it_meets(returning, outdoor, setpoint, flow, water):
    air = mix(flow=flow, returning=returning, outdoor=outdoor, setpoint=setpoint)
    assert min(returning, outdoor) - 1e-9 <= air.mixed_temperature <= max(returning, outdoor) + 1e-9
    assert 0.2 * flow - 1e-9 <= air.outdoor_flow <= flow + 1e-9
    assert air.cooled_temperature >= min(air.mixed_temperature, max(air.target, 279.85)) - 1e-9
    warm = HANDLER.warm(OPS, air, water, 1.0)
    supply = warm.offset + warm.slope * water
    behind_coil = supply - air.fan_rise
    assert behind_coil <= max(water, air.cooled_temperature) + 1e-9
    assert 0.0 <= warm.flow_share <= 1.0
    # never beyond what was wanted, from either side
    assert behind_coil <= max(air.target, air.cooled_temperature) + 1e-9


def test_the_fan_warms_the_air_that_coils_make_colder_for_it():
    air = mix(outdoor=300.0, setpoint=287.0)
    rate = 1006.0 * 1.5
    assert air.fan_rise == pytest.approx(air.supply_fan_power / rate, rel=1e-9)
    warm = HANDLER.warm(OPS, air, 340.0, 1.0)
    assert warm.offset + warm.slope * 340.0 == pytest.approx(287.0)


def test_a_heater_gives_what_it_can():
    handler = AirHandler(Fan(2.0), heating=Heater(5000.0))
    air = mix(handler, outdoor=255.0, setpoint=300.0)
    warm = handler.warm(OPS, air, 300.0, 1.0)
    assert warm.direct == 5000.0
    assert warm.offset == pytest.approx(air.cooled_temperature + 5000.0 / (1006.0 * 1.5) + air.fan_rise, rel=1e-9)


def test_without_coils_air_is_only_mixed():
    handler = AirHandler(Fan(2.0), economizer=False)
    air = mix(handler, outdoor=273.0, setpoint=300.0)
    assert handler.warm(OPS, air, 300.0, 1.0).offset == pytest.approx(air.mixed_temperature + air.fan_rise)
    assert air.sensible == 0.0 and air.exhaust_fan_power == 0.0


def test_parameters_out_of_range_are_refused():
    with pytest.raises(ModelError, match=r"AirHandler.minimum_outdoor_share: expected 0 to 1 -, found 1.2"):
        AirHandler(Fan(1.0), minimum_outdoor_share=1.2)
    with pytest.raises(ModelError, match="expected a WaterCoil, a Heater or None, found float"):
        AirHandler(Fan(1.0), heating=5.0)
    with pytest.raises(ModelError, match=r"Heater.capacity"):
        Heater(-1.0)
