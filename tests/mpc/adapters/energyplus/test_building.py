"""What the library makes of EnergyPlus' reference buildings: plant, zone table, sizes, and a case."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.errors import EnergyPlusError

pytestmark = pytest.mark.energyplus


def test_the_plant_of_the_medium_office_is_found(office):
    layout = office.layout
    assert [loop.name for loop in layout.air_loops] == ["VAV_1", "VAV_2", "VAV_3"]
    assert [len(loop.terminals) for loop in layout.air_loops] == [5, 5, 5]
    assert layout.others == ("FirstFloor_Plenum", "MidFloor_Plenum", "TopFloor_Plenum")
    assert not layout.water_loops and not layout.chillers
    assert {t.coil_type for t in layout.terminals} == {"Coil:Heating:Electric"}
    assert layout.air_loops[0].of_kind("Coil:Cooling") == (("Coil:Cooling:DX:TwoSpeed", "VAV_1_CoolC DXCoil"),)


def test_the_hot_water_of_the_large_office_is_found():
    from mpc.adapters.energyplus.input import building_path, read_input
    from mpc.adapters.energyplus.layout import find_layout

    layout = find_layout(read_input(building_path("RefBldgLargeOfficeNew2004_Chicago")))
    assert [loop.name for loop in layout.water_loops] == ["HeatSys1"]
    assert layout.water_loops[0].boilers == (("Boiler:HotWater", "HeatSys1 Boiler"),)
    assert len(layout.air_loops) == 4 and len(layout.terminals) == 16 and len(layout.chillers) == 2
    assert all(t.water_node for t in layout.terminals)


def test_the_zone_table_has_the_floor_areas_and_glass_of_the_reference_building(office):
    table = office.building.geometry
    # Deru et al. 2011, NREL/TP-5500-46861: 4,982 m2, a third of the walls of glass
    assert sum(z.floor_area for z in table.zones) == pytest.approx(4982.0, abs=1.0)
    glass = sum(s.area for s in table.surfaces if s.kind == "window")
    walls = sum(s.area for s in table.surfaces if s.kind == "wall" and s.other == "outdoor")
    assert glass == pytest.approx(652.8, abs=1.0)
    # the storeys' 2.74 m of the facade; the plenums' belong to the plenums
    assert glass + walls == pytest.approx(3 * 2 * (49.911 + 33.2738) * 2.7432, rel=1e-3)
    facing = {s.azimuth for s in table.surfaces if s.kind == "window"}
    assert facing == {0.0, 90.0, 180.0, 270.0}
    # each partition once, and each floor and ceiling towards the plenums
    partitions = [s for s in table.surfaces if s.kind == "wall" and s.other in office.building.zone_names]
    assert len({frozenset((s.zone, s.other, str(s.area))) for s in partitions if s.other != s.zone}) == 24
    assert sum(s.area for s in table.surfaces if s.kind == "ceiling") == pytest.approx(4982.0, abs=1.0)
    # both faces of mass inside a zone look at it; together they are what EnergyPlus has
    inside = sum(2.0 * s.area for s in table.surfaces if s.other == s.zone)
    masses = office.source.of_type("InternalMass").values()
    assert inside == pytest.approx(sum(m["surface_area"] for m in masses), rel=1e-6)
    assert office.building.measured_boundaries == office.layout.others


def test_layers_run_from_the_zone_outwards(office):
    wall = office.building.geometry.constructions["STEEL FRAME NON-RES EXT WALL"]
    assert wall[0].thickness == pytest.approx(0.0127) and wall[0].conductivity == pytest.approx(0.16)  # gypsum
    resistance = sum(layer.thickness / layer.conductivity for layer in wall)
    # ASHRAE 90.1-2004, climate zone 5, steel frame: 0.477 W/m2/K with films of 0.03 and 0.12 m2 K/W
    assert 1.0 / (resistance + 0.15) == pytest.approx(0.477, abs=0.002)


def test_a_day_is_a_case_that_can_be_saved_and_read(own, tmp_path):
    from thermal import load_case, save_case

    case = own.case()
    save_case(case, tmp_path / "office")
    again = load_case(tmp_path / "office")
    assert again.building.zone_names == own.zone_names
    assert again.step == 600.0 and len(again.stamps) == 144
    np.testing.assert_allclose(again.zone_heat().to_numpy(), case.zone_heat().to_numpy(), rtol=1e-5, atol=1.0)
    temperatures = again.boundary_temperatures()
    assert set(own.source.layout.others) < set(temperatures) and temperatures.notna().all(axis=None)


def test_a_controllers_plant_has_energyplus_sizes(office):
    from mpc.adapters.energyplus.system import controller_system

    system = controller_system(office, 0.34)
    fan = system.air_handlers[0].supply_fan
    assert fan.design_power == pytest.approx(office.size("VAV_1_Fan", "Design Electric Power Consumption"))
    np.testing.assert_allclose(system.terminals.minimum_flow, 0.3 * system.terminals.design_flow)
    assert system.terminals.air_handler.tolist() == [0] * 5 + [1] * 5 + [2] * 5
    assert system.loop.efficiency * system.loop.efficiency_curve.coefficients[0] == pytest.approx(0.34)


def test_unknown_names_are_refused_with_the_nearest():
    from mpc.adapters.energyplus.building import energyplus_building

    with pytest.raises(EnergyPlusError, match="RefBldgMediumOfficeNew2004_Chicago"):
        energyplus_building("RefBldgMediumOffice")
    with pytest.raises(EnergyPlusError, match="Chicago"):
        energyplus_building("RefBldgMediumOfficeNew2004_Chicago", "USA_IL_Chicago")
    with pytest.raises(EnergyPlusError, match=r"none at .*nowhere.idf"):
        energyplus_building("nowhere.idf")


def test_a_building_without_vav_is_refused_with_what_it_has():
    from mpc.adapters.energyplus.building import energyplus_building

    with pytest.raises(EnergyPlusError, match="VAV terminals.*ConstantVolume:NoReheat"):
        energyplus_building("RefBldgWarehouseNew2004_Chicago")


def test_a_size_that_is_not_there_is_refused_with_those_that_are(office):
    with pytest.raises(EnergyPlusError, match="Design Electric Power Consumption"):
        office.size("VAV_1_Fan", "Colour")
