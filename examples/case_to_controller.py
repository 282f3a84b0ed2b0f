"""From a case to a running controller: calibrate, make a plant and a controller of what was found, close the loop."""

from calibration import calibrate
from mpc.kpi.kpis import Kpis, measure_kpis
from mpc.loop.make import PlantSettings, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.run import run_closed_loop
from mpc.model import control_model
from mpc.scenario.weather_files import weather_of_case
from mpc.studies.optimal_control import make_controller
from thermal import load_bundled_case


def run(hours: float = 3.0) -> Kpis:
    """Calibrate the bundled case with the sun through its windows, and control it for the hours of a Monday morning."""
    case = load_bundled_case()
    fitted = calibrate(case, settings={"dx": 1.0, "effects": ["solar_gain"], "starts": 1})
    # actions every three steps of 5 minutes, forecasts of 144 steps: 12 hours
    settings = PlantSettings(parameters=fitted, noise=SensorNoise(), control_steps=3, horizon=144)
    plant = simulated_plant(case.building, weather_of_case(case), "2023-03-06T06:00", "2023-03-07", settings)
    controller = make_controller(control_model(case.building, fitted), plant)
    loop = run_closed_loop(plant, controller, steps=round(4 * hours), forecasts=True)
    return measure_kpis(loop.record, plant.scenario, control_step=plant.control_step)


if __name__ == "__main__":
    kpis = run()
    print(f"{kpis.ener_tot:.3f} kWh/m2, {kpis.cost_tot:.4f} {kpis.currency}/m2, {kpis.tdis_tot:.2f} K h of discomfort")
