"""A calibrated building as a linear system: poles, step and frequency response by python-control."""

from pathlib import Path

import control
import numpy as np

from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model

ZONE = "F1_C"


def linear_office(order: int = 60) -> control.StateSpace:
    """Reduce the bundled office at start values and hand it to python-control."""
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    return reduced_model(grid, [grid.network.start()], order=order).to_control()


def draw(system: control.StateSpace, path: str | Path) -> None:
    """Draw time constants, and the answer of one zone to its own heat and to the outdoor temperature."""
    import matplotlib.pyplot as plt

    figure, (poles, steps, gains) = plt.subplots(1, 3, figsize=(11.0, 3.2), layout="constrained")
    slow = np.sort(-1.0 / system.poles().real)[::-1] / 3600.0
    poles.semilogy(np.arange(1, slow.size + 1), slow, "o", markersize=3)
    poles.set(xlabel="mode", ylabel="time constant (h)", title="Poles")
    times, frequencies = np.arange(0.0, 48.0 * 3600.0, 300.0), np.geomspace(1e-7, 1e-3, 200)
    drives = ((f"heat of {ZONE}", 1000.0, "1 kW of heat"), ("temperature of outdoor", 1.0, "1 K outdoors"))
    for name, size, label in drives:
        one = system[system.output_labels.index(f"temperature of {ZONE}"), system.input_labels.index(name)]
        rise = control.forced_response(one, times, np.full(times.size, size)).outputs
        steps.plot(times / 3600.0, rise, label=label)
        gains.loglog(frequencies * 86400.0, size * np.abs(one(2j * np.pi * frequencies)), label=label)
    steps.set(xlabel="time (h)", ylabel="rise (K)", title=f"Step response of {ZONE}")
    gains.set(xlabel="cycles a day", ylabel="amplitude (K)", title="Frequency response")
    steps.legend(frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    office = linear_office()
    draw(office, "linear_model.png")
    print(f"slowest pole: a time constant of {1.0 / np.abs(office.poles().real).min() / 86400.0:.1f} days")
