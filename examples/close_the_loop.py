"""Run a small office in closed loop for a winter day: fixed setpoints, noisy sensors, indicators at the end."""

from mpc.kpi.kpis import Kpis, measure_kpis
from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.run import FixedSetpoints, run_closed_loop
from thermal.pilot.building import pilot_building

DAY, NEXT = "2023-01-09", "2023-01-10"


def run(supply_water: float = 333.15) -> Kpis:
    """Hold the supply water at a temperature [K] and the supply air at 14 degC for a day."""
    building = pilot_building(1, floor_area=600.0, zones=12)
    settings = PlantSettings(dx=1.0, noise=SensorNoise())
    plant = simulated_plant(building, pilot_weather(1, DAY, 1.0), DAY, NEXT, settings)
    setpoints = {"supply_air_temperature_setpoint": 287.15, "supply_water_temperature_setpoint": supply_water}
    closed = run_closed_loop(plant, FixedSetpoints(setpoints, plant.actuators), seed=1)
    return measure_kpis(closed.record, plant.scenario)


if __name__ == "__main__":
    for water in (313.15, 333.15, 353.15):
        kpis = run(water)
        print(f"water at {water:.0f} K: {kpis.ener_tot:.3f} kWh/m2, {kpis.tdis_tot:.2f} K h of discomfort")
