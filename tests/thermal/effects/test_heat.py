"""Heat that an effect brings, worked out from its equation, against what enters the model's volumes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from pvlib import atmosphere, irradiance, solarposition

from thermal import Case, SymbolicModel, ThermalNetwork, build_network
from thermal.effects.catalogue import CATALOGUE, chosen
from thermal.effects.effect import PAIR
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.inputs.sun import incidence_modifier
from thermal.units import air_density

FloatArray = NDArray[np.float64]
CaseOf = Callable[[str], Case]

AIR = air_density(690.0) * 1006.0  # J/m3/K
FLOOR = {"A": 10.5, "B": 7.5, "C": 10.5, "D": 7.5}  # m2 in the plan: half of the partition counts to either side
REFERENCE = 293.15
KINDS = ("plan", "table")


@dataclass
class Bench:
    """A building with effects, and the heat that these bring in a state of random temperatures."""

    case: Case
    network: ThermalNetwork
    values: dict[str, float]

    def __post_init__(self) -> None:
        rng = np.random.default_rng(4)
        self.drivers = telemetry_inputs(self.case)
        self.stamp = 80  # early afternoon of the first day
        self.states = rng.normal(0.0, 3.0, self.network.n_node)
        self.outside = rng.normal(-10.0, 3.0, len(self.network.boundaries))
        self.signals = signal_values(self.network.signals, self.drivers)[self.stamp]

    def heat(self, **values: float) -> FloatArray:
        """Heat that the effects bring to each volume [W], by the difference from no strength."""
        given = {p.name: 0.0 for p in self.network.parameters if p.effect and p.start == 0.0}
        full = np.concatenate([self.states, self.outside, self.signals])
        flows = [
            -np.asarray(SymbolicModel(self.network).matrices(self.network.values(v)).flow @ full)
            for v in ({**given, **self.values, **values}, given)
        ]
        return flows[0] - flows[1]

    def zone_temperature(self, zone: str) -> float:
        """Mean of a zone's air, from the reference [K]."""
        return float((self.network.observation @ self.states)[self.network.zones.index(zone)])

    def outdoor(self) -> float:
        """As the signals have it [K]."""
        return float(self.drivers.outdoor[self.stamp])

    def usual(self, zone: str) -> float:
        """Usual temperature of a zone [K]."""
        return float(self.drivers.usual[self.stamp, self.network.zones.index(zone)])


def bench(case: Case, *ids: str, **values: float) -> Bench:
    return Bench(case, build_network(case.building, effects=chosen(ids)), values)


def irradiances(b: Bench, azimuth: float, tilt: float = 90.0) -> tuple[float, float, float]:
    """Beam and diffuse on a plane by pvlib [W/m2], and the cosine of incidence."""
    frame = b.case.telemetry.frame.iloc[[b.stamp]]
    middle = frame.index - np.timedelta64(300, "s")
    place = solarposition.get_solarposition(middle, 48.0, 12.0, 690.0)
    zenith = 90.0 - place["elevation"].to_numpy()
    normal, diffuse = (
        frame[f"weather_station/{n}_irradiance_sensor"].to_numpy() for n in ("direct_normal", "diffuse_horizontal")
    )
    total = irradiance.get_total_irradiance(
        tilt, azimuth, zenith, place["azimuth"].to_numpy(), normal, normal * np.cos(np.radians(zenith)) + diffuse, diffuse,
        albedo=0.2, model="perez", dni_extra=irradiance.get_extra_radiation(middle.day_of_year.to_numpy()),
        airmass=atmosphere.get_relative_airmass(zenith),
    )  # fmt: skip
    cosine = irradiance.aoi_projection(tilt, azimuth, zenith, place["azimuth"].to_numpy())
    return float(total["poa_direct"][0]), float(total["poa_diffuse"][0]), float(cosine[0])


def through(b: Bench, azimuth: float) -> float:
    beam, diffuse, cosine = irradiances(b, azimuth)
    return float(incidence_modifier(np.array([cosine]))[0] * beam + 0.86 * diffuse)


# glass in m2, by the azimuth of the turned plan; the table's transmittance of 0.5 counts against the usual 0.6
PANES = {
    "plan": {("A", 200.0): 2.0, ("A", 290.0): 1.5, ("D", 110.0): 3.0},
    "table": {("A", 180.0): 3.0 * 0.5 / 0.6},
}


@pytest.mark.parametrize("kind", KINDS)
def test_sun_through_glass(lively_case: CaseOf, kind: str) -> None:
    b = bench(lively_case(kind), "solar_gain", solar_heat_gain_coefficient=0.45, solar_share_to_floor=0.3)
    heat = b.heat()
    expected = {key: 0.45 * area * through(b, key[1]) for key, area in PANES[kind].items()}
    assert heat.sum() == pytest.approx(sum(expected.values()), rel=1e-9)
    floor = np.isin(b.network.kind, ["slab", "furniture"])
    assert heat[floor].sum() == pytest.approx(0.3 * heat.sum(), rel=1e-9)
    assert heat[b.network.kind == "radiant"].sum() == pytest.approx(0.7 * heat.sum(), rel=1e-9)
    for zone in b.network.zones:
        mine = b.network.zone == b.network.zones.index(zone)
        assert heat[mine].sum() == pytest.approx(
            sum(v for k, v in expected.items() if k[0] == zone), rel=1e-9, abs=1e-9
        )
    assert min(expected.values()) > 50.0


def test_blinds_take_their_share_where_the_sun_is_strong(lively_case: CaseOf) -> None:
    b = bench(lively_case("plan"), "solar_gain", "blinds", solar_heat_gain_coefficient=0.5)
    gained = b.heat(blind_shading=0.0).sum()
    bright = {key: sum(irradiances(b, key[1])[:2]) for key in PANES["plan"]}
    assert bright["A", 200.0] > 400.0  # in the early afternoon only the south is in the full sun
    assert 100.0 < bright["A", 290.0] < 200.0

    def over(threshold: float) -> float:
        panes = PANES["plan"].items()
        return sum(0.5 * area * through(b, key[1]) for key, area in panes if bright[key] > threshold)

    assert over(300.0) < over(100.0)
    for threshold, drawn in (
        (200.0, over(200.0)),
        (100.0, over(100.0)),
        (130.0, 0.7 * over(100.0) + 0.3 * over(200.0)),
    ):
        taken = gained - b.heat(blind_shading=0.6, blind_irradiance=threshold).sum()
        assert taken == pytest.approx(0.6 * drawn, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_sun_on_walls_is_a_warmer_outdoor_air(lively_case: CaseOf, kind: str) -> None:
    # the sol-air temperature: α I / h_o more outdoors, on the walls of that side alone
    case = lively_case(kind)
    network = build_network(
        case.building, effects=chosen(["solar_opaque"]), scopes={"exterior_convection_coefficient": "facade"}
    )
    films = {p.name: p.start * (1.0 + 0.2 * k) for k, p in enumerate(network.parameters) if "@facade" in p.name}
    b = Bench(case, network, {"solar_absorptance": 0.7, **films})
    theta = network.values(films)
    kappa = dict(
        zip(
            [c.name for c in network.conductances],
            np.asarray(SymbolicModel(network).classes(theta)[0]).ravel(),
            strict=True,
        )
    )
    expected = np.zeros(network.n_node)
    looks = {"plan": {"north": 20.0, "east": 110.0, "south": 200.0, "west": 290.0},
             "table": {"south": 180.0, "west": 270.0, "roof": 0.0}}[kind]  # fmt: skip
    for c in network.conductances:
        wall = not c.source and (c.second == network.n_node).all() and "window" not in c.name
        if not wall or "@facade:" not in c.name:
            continue
        side = c.name.rpartition("@facade:")[2].split(" ")[0]
        film = films[f"exterior_convection_coefficient@facade:{side}"]
        beam, diffuse, _ = irradiances(b, looks[side], 0.0 if side == "roof" else 90.0)
        if "interior" not in c.name:
            np.add.at(expected, c.first, kappa[c.name] * c.weight * 0.7 * (beam + diffuse) / film)
    heat = b.heat() - Bench(case, network, films).heat()
    assert np.abs(heat - expected).max() < 1e-9 * np.abs(expected).max()
    assert np.abs(expected).sum() > 100.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_cold_sky_is_a_colder_outdoor_air(lively_case: CaseOf, kind: str) -> None:
    # ε F (L - σ T^4) / h_o less outdoors, of which vertical faces see a half and the roof all
    case = lively_case(kind)
    b = bench(case, "longwave_sky", sky_exchange_factor=0.8)
    frame = case.telemetry.frame.iloc[b.stamp]
    deficit = (
        frame["weather_station/horizontal_infrared_irradiance_sensor"]
        - 5.670374419e-8 * frame["weather_station/outside_air_temperature_sensor"] ** 4
    )
    assert deficit < -10.0
    theta = b.network.start()
    kappa = np.asarray(SymbolicModel(b.network).classes(theta)[0]).ravel()
    film = dict(zip([p.name for p in b.network.parameters], theta, strict=True))["exterior_convection_coefficient"]
    expected = 0.0
    for c, value in zip(b.network.conductances, kappa, strict=True):
        if c.source or not (c.second == b.network.n_node).all() or "interior" in c.name:
            continue
        glass = kind == "plan" and "window" in c.name  # the rated film of a plan's windows
        h_o, view = 25.0 if glass else film, 1.0 if c.name.startswith("slab") else 0.5
        expected += value * c.weight.sum() * view * 0.8 * deficit / h_o
    assert b.heat().sum() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_wind_on_the_film_is_its_first_order(lively_case: CaseOf, kind: str) -> None:
    # exactly: the faces to outdoor with a film of h_o + h_1 (v - mean v), nodes and outdoors as the effect takes them
    case = lively_case(kind)
    plain = build_network(case.building)
    errors = []
    for slope in (2.0, 1.0):
        b = bench(case, "wind_film", wind_film_slope=slope)
        usual = b.drivers.usual[b.stamp]
        b.states[:] = usual.mean() - REFERENCE
        for k in range(len(usual)):
            mine = (b.network.zone == k) & np.isin(b.network.kind, ["air", "radiant"])
            b.states[mine] = usual[k] - REFERENCE
        b.outside[:] = b.outdoor() - REFERENCE
        blown = b.drivers.wind[b.stamp] - b.drivers.wind.mean()
        walls = (
            b.network.kind == "exterior_wall"
            if kind == "plan"
            else np.isin(b.network.kind, ["wall", "slab", "air", "radiant"])
        )
        film = next(p.start for p in plain.parameters if p.name == "exterior_convection_coefficient")
        full = np.concatenate([b.states[: plain.n_node], b.outside])
        flows = []
        for h in (film + slope * blown, film):
            matrices = SymbolicModel(plain).matrices(plain.values({"exterior_convection_coefficient": h}))
            flows.append(-(matrices.flow @ full))
        exact = (flows[0] - flows[1])[walls].sum()
        errors.append(b.heat()[walls].sum() / exact - 1.0)
    assert abs(errors[1]) < 0.2
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.35)  # halved with the slope


EXCHANGES: Mapping[str, Mapping[str, float]] = {
    "infiltration": {"infiltration_rate": 0.4, "infiltration_by_wind": 0.1, "infiltration_by_stack": 0.08},
    "window_opening": {"window_opening_rate": 3.0},
}
VOLUMES = {"plan": {z: 3.0 * a for z, a in FLOOR.items()}, "table": {"A": 50.0, "B": 40.0}}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", EXCHANGES)
def test_outdoor_air(lively_case: CaseOf, kind: str, name: str) -> None:
    # ρ c V n(t) (T_out - T): where a zone is as it usually is, the split into mean and rest is exact
    b = bench(lively_case(kind), name, **EXCHANGES[name])
    b.outside[0] = b.outdoor() - REFERENCE
    for k, zone in enumerate(b.network.zones):
        b.states[(b.network.zone == k)] = b.usual(zone) - REFERENCE
    wind = float(b.drivers.wind[b.stamp])
    heat = b.heat()
    for k, zone in enumerate(b.network.zones):
        difference = b.outdoor() - b.usual(zone)
        mild = float(np.clip((b.outdoor() - 285.15) / 10.0, 0.0, 1.0))
        rate = {
            "infiltration": 0.4 + 0.1 * wind + 0.08 * np.sqrt(abs(difference)),
            "window_opening": 3.0 * float(b.drivers.occupancy[b.stamp]) * mild,
        }[name]
        expected = AIR * VOLUMES[kind][zone] * rate / 3600.0 * difference
        assert heat[b.network.zone == k].sum() == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_infiltration_without_wind_measured_blows_as_usual(lively_case: CaseOf) -> None:
    case = lively_case("table")
    frame = case.telemetry.frame.drop(columns="weather_station/wind_speed_sensor")
    blind = Case(case.building, type(case.telemetry).from_frame(frame))
    b = bench(blind, "infiltration", infiltration_by_wind=0.1)
    for k in range(2):
        b.states[b.network.zone == k] = 0.0
    b.outside[0] = -10.0
    assert b.heat().sum() == pytest.approx(AIR * 90.0 * 0.1 * 3.0 / 3600.0 * -10.0, rel=1e-9)


FACADES = {"plan": {"A": (3 + 3.5 + 3.5) * 3.0, "B": (3 + 2.5 + 2.5) * 3.0}, "table": {"A": 15.0, "B": 9.0}}
FACADES["plan"] |= {"C": FACADES["plan"]["A"], "D": FACADES["plan"]["B"]}


@pytest.mark.parametrize("kind", KINDS)
def test_thermal_bridges(lively_case: CaseOf, kind: str) -> None:
    b = bench(lively_case(kind), "thermal_bridge", thermal_bridge_u_value=0.3)
    heat = b.heat()
    for k, zone in enumerate(b.network.zones):
        expected = 0.3 * FACADES[kind][zone] * (b.outside[0] - b.zone_temperature(zone))
        assert heat[b.network.zone == k].sum() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_neighbour(lively_case: CaseOf, kind: str) -> None:
    b = bench(lively_case(kind), "neighbour", neighbour_temperature=297.15)
    (name,) = (p.name for p in b.network.parameters if p.base == "neighbour_u_value")  # the one side without windows
    assert name.endswith({"plan": "@facade:20 deg", "table": "@facade:270 deg"}[kind])
    heat = b.heat(**{name: 1.5})
    bare = {"plan": {"A": 10.5, "B": 7.5, "C": 10.5, "D": 7.5}, "table": {"B": 9.0}}[kind]
    for k, zone in enumerate(b.network.zones):
        expected = 1.5 * bare.get(zone, 0.0) * (4.0 - b.zone_temperature(zone))
        assert heat[b.network.zone == k].sum() == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_floors_ground_and_roof(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    for name, parameter in (
        ("interfloor_exchange", "interfloor_u_value"),
        ("ground_exchange", "ground_u_value"),
        ("roof_exchange", "roof_u_value"),
    ):
        b = bench(case, name, **{parameter: 0.8})
        heat = b.heat()
        rooms = b.network.anatomy.rooms
        floor, ceiling = ({z: r.floor[-1] for z, r in rooms.items()}, {z: r.ceiling[-1] for z, r in rooms.items()})
        for zone, other in zip("ABCD", "CDAB", strict=True):
            lower = zone in "AB"
            back = floor if (name == "ground_exchange") or (name == "interfloor_exchange" and not lower) else ceiling
            mine = b.states[back[zone]]
            expected = {
                "interfloor_exchange": b.states[(floor if lower else ceiling)[other]] - mine,
                "ground_exchange": (287.15 - REFERENCE - mine) * lower,
                "roof_exchange": (b.outside[0] - mine) * (not lower),
            }[name]
            assert heat[back[zone]] == pytest.approx(0.8 * FLOOR[zone] * expected, rel=1e-9, abs=1e-9)
        assert np.count_nonzero(np.abs(heat) > 1e-9) == (4 if name == "interfloor_exchange" else 2)


def test_a_floor_of_a_zone_table_meets_the_ground_through_its_last_layer(lively_case: CaseOf) -> None:
    b = bench(lively_case("table"), "ground_exchange", ground_u_value=0.9, ground_temperature=283.15)
    heat = b.heat()
    (node,) = np.flatnonzero(np.abs(heat) > 1e-9)
    assert b.network.kind[node] == "slab"
    # in series with half of the last wall node's share of 0.2 m at 0.5 and 0.1 m at 0.04 W/m/K
    layers, nodes = 0.2 / 0.5 + 0.1 / 0.04, np.count_nonzero(b.network.kind == "slab") / 3
    assert nodes >= 2
    conductance = heat[node] / (16.0 * (283.15 - REFERENCE - b.states[node]))
    assert 1.0 / (1.0 / 0.9 + layers / 2.0) < conductance < 0.9


def test_the_sun_warms_a_roof_that_is_there(lively_case: CaseOf) -> None:
    b = bench(lively_case("plan"), "roof_exchange", "solar_opaque", roof_u_value=0.5)
    warmed = b.heat(solar_absorptance=0.6) - b.heat(solar_absorptance=0.0)
    roof = (b.network.kind == "slab") & (b.network.zone >= 2)
    assert warmed[roof].sum() == pytest.approx(0.5 / 25.0 * 0.6 * sum(irradiances(b, 0.0, 0.0)[:2]) * 18.0, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_people(lively_case: CaseOf, kind: str) -> None:
    b = bench(lively_case(kind), "internal_gains", internal_gain=12.0, base_load=2.0)
    floor = FLOOR if kind == "plan" else {"A": 20.0, "B": 16.0}
    presence = float(b.drivers.occupancy[b.stamp])
    assert presence == 1.0
    for k, zone in enumerate(b.network.zones):
        heat, mine = b.heat(), b.network.zone == k
        assert heat[mine].sum() == pytest.approx(14.0 * floor[zone], rel=1e-9)
        assert heat[mine & (b.network.kind == "air")].sum() == pytest.approx(7.0 * floor[zone], rel=1e-9)


def test_people_who_come_later(lively_case: CaseOf) -> None:
    # first order: presence of a quarter of an hour ago, away from the corners of the ramp
    b = bench(lively_case("table"), "internal_gains", internal_gain=12.0, internal_gain_delay=0.25)
    row = int(np.flatnonzero((b.drivers.occupancy > 0.4) & (b.drivers.occupancy < 0.6))[0])
    b.signals = signal_values(b.network.signals, b.drivers)[row]
    presence = float(b.drivers.occupancy[row]) - 0.25  # people arrive within an hour
    assert b.heat().sum() == pytest.approx(12.0 * presence * 36.0, rel=1e-9)


def test_water_that_evaporates(lively_case: CaseOf) -> None:
    b = bench(lively_case("table"), "latent_load", latent_load=5.0)
    heat = b.heat()
    assert heat[b.network.kind == "air"].sum() == heat.sum() == pytest.approx(-5.0 * 36.0, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_air_between_zones(lively_case: CaseOf, kind: str) -> None:
    pairs = {"plan": (("A", "B"), ("C", "D")), "table": (("A", "B"),)}[kind]
    values = {f"door_airflow@{PAIR.join(pair)}": 0.1 for pair in pairs}
    b = bench(lively_case(kind), "zone_mixing", door_presence_share=0.4, **values)
    heat = b.heat()
    assert heat.sum() == pytest.approx(0.0, abs=1e-9)  # what one zone gives, the other receives
    assert set(b.network.kind[np.abs(heat) > 1e-9]) == {"air"}
    presence = float(b.drivers.occupancy[b.stamp])
    for first, second in pairs:
        now = b.zone_temperature(second) - b.zone_temperature(first)
        usual = b.usual(second) - b.usual(first)
        expected = AIR * 0.1 * ((0.6 + 0.4 * 0.3) * now + 0.4 * (presence - 0.3) * usual)
        got = heat[b.network.zone == b.network.zones.index(first)].sum()
        assert got == pytest.approx(expected, rel=1e-9)


def test_every_effect_of_heat_is_worked_out_here_or_with_the_meters() -> None:
    with_the_meters = {
        "hidden_mass",
        "clock_shift",
        "wrong_station",
        "flow_gain",
        "duct_loss",
        "capacity_limit",
        "valve_leak",
        "sensor_bias",
        "sensor_lag",
    }
    here = {
        "solar_gain", "blinds", "solar_opaque", "longwave_sky", "wind_film", "infiltration", "window_opening",
        "thermal_bridge", "neighbour", "interfloor_exchange", "ground_exchange", "roof_exchange", "internal_gains",
        "latent_load", "zone_mixing", "ventilation",
    }  # fmt: skip
    assert here | with_the_meters == set(CATALOGUE)
