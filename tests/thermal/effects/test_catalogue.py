"""The catalogue: its contract, its errors, what cannot be tested and why, and the page that documents it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pint
import pytest

from thermal import Case, FloorPlans, SymbolicModel, Telemetry, ZoneTable, build_network
from thermal.effects.catalogue import CATALOGUE, chosen, register_effect
from thermal.effects.effect import ALIKE, Chosen, Effect, EffectBuilder
from thermal.errors import EffectError
from thermal.inputs.normalisation import WIND
from thermal.inputs.provider import INFRARED, IRRADIANCE, InputProvider, telemetry_inputs
from thermal.parameters import PARAMETERS, Parameter

CaseOf = Callable[[str], Case]
UNITS = pint.UnitRegistry()
DIFFUSE, GLOBAL = "diffuse_horizontal_irradiance_sensor", "global_horizontal_irradiance_sensor"
DOCS = Path(__file__).parents[3] / "docs"

# Fixed for all who read or write a diagnosis.
IDS = (
    "solar_gain solar_opaque longwave_sky wind_film infiltration internal_gains interfloor_exchange ground_exchange "
    "roof_exchange hidden_mass zone_mixing sensor_bias sensor_lag duct_loss flow_gain capacity_limit valve_leak "
    "clock_shift latent_load neighbour window_opening thermal_bridge blinds wrong_station ventilation"
).split()


def test_every_id_is_there() -> None:
    assert set(CATALOGUE) == set(IDS)


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_effect_keeps_its_contract(name: str) -> None:
    effect = CATALOGUE[name]
    assert effect.parameters[0].start == 0.0 and effect.parameters[0].scale == "linear"
    assert not {p.name for p in effect.parameters} & set(PARAMETERS)
    for p in effect.parameters:
        assert p.effect == name and len(p.source) > 5
        UNITS.parse_units(p.unit)
    known = set(CATALOGUE) | set(PARAMETERS)
    assert not [c for c in effect.confounders if "_" in c and c not in known]
    order = list(CATALOGUE)
    assert all(order.index(r) < order.index(name) for r in effect.requires)
    assert effect.separated_by and effect.source and effect.acts_on and effect.title and effect.equation


def test_names_of_parameters_are_one_effects_own() -> None:
    names = [p.name for e in CATALOGUE.values() for p in e.parameters]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        (["solar_gains"], "'solar_gains': not in the catalogue; the nearest valid one is 'solar_gain'"),
        (["blinds"], "effect blinds: modifies solar_gain; add that too"),
        ({"sensor_bias": "A"}, "effect sensor_bias: expected a sequence of zones, found 'A'"),
    ],
)
def test_what_cannot_be_chosen(effects: object, message: str) -> None:
    with pytest.raises(EffectError, match=message):
        chosen(effects)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"sensor_bias": ["A", "Z"]}, r"effect sensor_bias: zones \['Z'\] are not of this building"),
        ({"infiltration": ["A"]}, r"effect infiltration: acts on the whole building, got zones \['A'\]"),
    ],
)
def test_where_an_effect_cannot_be(lively_case: CaseOf, effects: dict[str, list[str]], message: str) -> None:
    with pytest.raises(EffectError, match=message):
        build_network(lively_case("plan").building, effects=chosen(effects))


def test_an_effect_of_some_zones_has_their_parameters(lively_case: CaseOf) -> None:
    network = build_network(lively_case("plan").building, effects=(Chosen(CATALOGUE["flow_gain"], ("C", "B")),))
    assert {p.name for p in network.parameters if p.effect} == {"flow_gain@B", "flow_gain@C"}


@pytest.mark.parametrize("name", [name for name, effect in CATALOGUE.items() if effect.zonal])
def test_zones_that_are_alike_are_those_with_the_same_strengths(name: str, lively_case: CaseOf) -> None:
    building = lively_case("plan").building
    apart, alike = (build_network(building, effects=(Chosen(CATALOGUE[name], where),)) for where in ((), ALIKE))
    base = {p.name: p for p in CATALOGUE[name].parameters}
    assert {p.name for p in alike.parameters if p.effect == name} <= set(base)
    assert {p.base for p in apart.parameters if p.effect == name} == {
        p.name for p in alike.parameters if p.effect == name
    }
    at = {n: p.start + 0.3 * (p.upper - p.start) for n, p in base.items()}
    found = []
    for network in (apart, alike):
        values = {p.name: at[p.base] for p in network.parameters if p.effect == name}
        made = SymbolicModel(network).matrices(network.values(values))
        found.append((made.flow.toarray(), made.capacity.toarray()))
    for one, other in zip(*found, strict=True):
        assert one.shape == other.shape and np.abs(one - other).max() <= 1e-12 * np.abs(one).max()


def reasons(case: Case) -> dict[str, str]:
    drivers, anatomy = telemetry_inputs(case), build_network(case.building).anatomy
    return {name: reason for name, e in CATALOGUE.items() if (reason := e.untestable(drivers, anatomy)) is not None}


def without(case: Case, *points: str) -> Case:
    frame = case.telemetry.frame.drop(columns=[f"weather_station/{p}" for p in points])
    return replace(case, telemetry=Telemetry.from_frame(frame), judged=None)


def test_what_a_complete_case_cannot_tell(lively_case: CaseOf) -> None:
    assert reasons(lively_case("plan")) == {}
    assert reasons(lively_case("table")) == {
        "interfloor_exchange": "no zone lies above another",
        "roof_exchange": "what lies above the zones is described by the case itself",
    }


def test_what_a_poor_weather_station_cannot_tell(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    sun = dict.fromkeys(("blinds", "solar_opaque"), f"not measured: {IRRADIANCE}")
    sun |= {} if len(case.stamps) * case.step >= 2.0 * 86400.0 else {"solar_gain": f"not measured: {IRRADIANCE}"}
    poor = reasons(without(case, IRRADIANCE, WIND, INFRARED))
    assert poor == reasons(case) | sun | {
        "wind_film": f"not measured: {WIND}",
        "longwave_sky": f"not measured: {INFRARED}",
    }


def test_what_a_building_without_the_part_cannot_have(lively_case: CaseOf) -> None:
    case = lively_case("table")
    table = case.building.geometry
    assert isinstance(table, ZoneTable)
    inside = tuple(s for s in table.surfaces if s.other in ("A", "B", "attic"))
    closed = replace(case, building=replace(case.building, geometry=replace(table, surfaces=inside)), judged=None)
    said = reasons(closed)
    assert said["solar_gain"] == "the building has no windows to outdoor"
    assert said["solar_opaque"] == "the building has no opaque walls to outdoor"
    assert said["infiltration"] == said["neighbour"] == "the building has no exterior walls"
    assert said["ground_exchange"] == "no zone lies on the ground"
    assert said["wind_film"] == "the building has no surfaces to outdoor"
    single = replace(table, surfaces=tuple(s for s in table.surfaces if s.name in "WG"))
    alone = replace(case, building=replace(case.building, geometry=single, airflows=()), judged=None)
    assert reasons(alone)["zone_mixing"] == "no two zones share a partition"


def test_a_side_with_windows_is_no_party_wall(lively_case: CaseOf) -> None:
    case = lively_case("plan")
    plans = case.building.geometry
    assert isinstance(plans, FloorPlans)

    def party(glazing: dict[str, dict[str, float]]) -> tuple[str | None, list[str]]:
        building = replace(case.building, geometry=replace(plans, glazing=glazing))
        network = build_network(building, effects=chosen({"neighbour": ()}))
        told = CATALOGUE["neighbour"].untestable(telemetry_inputs(case), network.anatomy)
        return told, sorted(p.member or "" for p in network.parameters if p.base == "neighbour_u_value")

    assert [len(party(g)[1]) for g in ({}, {"A": {"south": 2.0}}, {"A": {"south": 2.0, "west": 1.0}})] == [4, 3, 2]
    everywhere = {"A": {"south": 2.0, "west": 1.5}, "D": {"east": 3.0, "north": 1.0}}
    assert party(everywhere) == ("every side has windows, so that none is a party wall", [])


_HEAD = ("id", "what, and its heat", "acts on", "parameters", "needs", "looks like", "told apart by", "source")


def catalogue_table(effects: Iterable[Effect]) -> str:
    """Effects as the Markdown table of the page, one row each."""
    rows = [_HEAD, tuple("-" * 3 for _ in _HEAD), *(_cells(e) for e in effects)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _cells(effect: Effect) -> tuple[str, ...]:
    needs = ", ".join(f"`{n}`" for n in (*effect.needs, *effect.requires)) or "no signal of its own"
    alike = ", ".join(name if " " in name else f"`{name}`" for name in effect.confounders)
    cells = (
        f"`{effect.id}`",
        f"{effect.title}: {effect.equation}",
        effect.acts_on + ("; a strength a zone" if effect.zonal else ""),
        "<br>".join(_range(p) for p in effect.parameters),
        needs,
        alike,
        effect.separated_by,
        effect.source,
    )
    return tuple(cell.replace("|", "\\|") for cell in cells)


def _range(parameter: Parameter) -> str:
    start = "" if parameter.start == 0.0 else f", from {parameter.start:g}"
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"`{parameter.name}` {parameter.lower:g} to {parameter.upper:g}{unit}{start}"


def test_signals_need_what_they_say_they_need(lively_case: CaseOf) -> None:
    """Every signal of the catalogue is made by a source that has its inputs, and nothing else."""
    case = lively_case("plan")
    whole, seen = telemetry_inputs(case), set()
    for name, effect in CATALOGUE.items():
        network = build_network(case.building, effects=chosen([*effect.requires, name]))
        for signal in network.signals:
            made_of = {s.removesuffix("_rate") for s in signal.inputs}
            wanted = {s for i in made_of for s in {"sun": (IRRADIANCE, DIFFUSE, GLOBAL), "sky": (INFRARED, "outdoor"),
                                                   "wind": (WIND,), "through_windows": ("outdoor",)}.get(i, (i,))}  # fmt: skip
            series = {s: v for s, v in whole.series.items() if s in wanted}
            few = InputProvider(case.building, whole.stamps, case.step, series, whole.normalisation)
            assert not few.lacks(signal.inputs) and np.isfinite(signal.of(few)).all()
            seen |= set(signal.inputs)
    assert len(seen) > 10


def windy(**changes: object) -> Effect:
    strength = Parameter("chimney_area", "m^2", 0.0, 0.0, 1.0, "any size of chimney", "linear", "chimney")
    whole = {"id": "chimney", "parameters": (strength,)} | changes
    return replace(CATALOGUE["thermal_bridge"], **whole)  # type: ignore[arg-type]


def test_an_effect_of_ones_own_enters_the_catalogue(lively_case: CaseOf) -> None:
    def build(builder: EffectBuilder) -> None:
        for room in builder.rooms:
            builder.air_to(room, builder.parameter("chimney_area"), builder.graph.boundary("outdoor"), 1.0)

    register_effect(windy(build=build))
    try:
        network = build_network(lively_case("plan").building, effects=chosen(["chimney", "flow_gain"]))
        assert list(CATALOGUE)[-1] == "chimney"
        assert {p.name.partition("@")[0] for p in network.parameters if p.effect} == {"chimney_area", "flow_gain"}
        with pytest.raises(EffectError, match="effect thermal_bridge: has no parameter 'chimney_area'"):
            build_network(
                lively_case("plan").building,
                effects=(Chosen(replace(CATALOGUE["thermal_bridge"], build=build)),),
            )
    finally:
        del CATALOGUE["chimney"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"id": "blinds"}, "effect blinds: expected a name of its own, found 'blinds'"),
        ({"parameters": CATALOGUE["blinds"].parameters}, "found 'blind_shading'"),
        ({"requires": ("chimneys",)}, "requires: expected effects of the catalogue, found 'chimneys'"),
        ({"parameters": ()}, "a strength that starts at 0 first"),
    ],
)
def test_what_cannot_be_registered(changes: dict[str, object], message: str) -> None:
    before = list(CATALOGUE)
    with pytest.raises(EffectError, match=message):
        register_effect(windy(**changes))
    assert list(CATALOGUE) == before


def test_the_page_has_the_catalogue() -> None:
    page = (DOCS / "effects.md").read_text(encoding="utf-8")
    shown = page.partition("<!-- catalogue -->\n")[2].partition("<!-- end -->")[0]
    wanted = catalogue_table(CATALOGUE.values())
    assert shown == wanted, f"docs/effects.md: put this between its marks:\n{wanted}"
