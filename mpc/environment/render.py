"""A run of an environment as picture and table."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpc.kpi.record import PlantRecord
from mpc.scenario.scenario import Scenario
from thermal.errors import MissingExtraError

_DAY = 86400.0  # s: what a picture shows
_FREEZING = 273.15  # K
_SIZE = 6.4, 4.8  # inches of 100 dots


@dataclass(frozen=True, eq=False)
class RenderedRun:
    """What is shown of a run.

    Parameters
    ----------
    zones : tuple of str
        Their names.
    scenario : Scenario
        Bands and clock.
    record : PlantRecord or None
        Of the run since its reset; None before the first step.
    now : int
        Step of the scenario that comes next.
    """

    zones: tuple[str, ...]
    scenario: Scenario
    record: PlantRecord | None
    now: int

    def table(self) -> str:
        """Table of the zones at the end of the last step, with the band that holds and the powers [degC], [kW]."""
        row = max(self.now - 1, 0)
        stamp = self.scenario.grid.stamps[row]
        if self.record is None:
            return f"{stamp:%Y-%m-%d %H:%M}  before the first step"
        zone = self.record.zone_temperature[-1] - _FREEZING
        lower, upper = (edge[row] - _FREEZING for edge in (self.scenario.lower, self.scenario.upper))
        gas = 0.0 if self.record.gas is None else float(self.record.gas[-1])
        power = f"electricity {self.record.electricity[-1] / 1e3:.2f} kW  gas {gas / 1e3:.2f} kW"
        lines = [f"{stamp:%Y-%m-%d %H:%M}  {power}", f"{'zone':<16} {'degC':>6} {'from':>6} {'to':>6}"]
        lines += [
            f"{name:<16} {t:6.2f} {low:6.2f} {high:6.2f}{'' if low <= t <= high else '  outside'}"
            for name, t, low, high in zip(self.zones, zone, lower, upper, strict=True)
        ]
        return "\n".join(lines)

    def picture(self) -> NDArray[np.uint8]:
        """Picture of the last day, zones with their band and powers, shape (height, width, 3).

        Raises
        ------
        MissingExtraError
            When matplotlib is not installed.
        """
        try:
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure
        except ImportError as error:
            advice = 'pictures of environments need matplotlib: pip install "buildingmpc[rl]"'
            raise MissingExtraError(advice) from error
        figure: Any = Figure(_SIZE, dpi=100, layout="constrained")
        canvas: Any = FigureCanvasAgg(figure)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        if self.record is not None:
            self._draw(above, below, self.record)
        above.set_ylabel("zones [°C]")
        below.set_ylabel("power [kW]")
        below.set_xlabel("hours since local midnight")
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def _draw(self, above: Any, below: Any, record: PlantRecord) -> None:
        step = record.step
        count = min(record.n_steps, round(_DAY / step))
        each = round(self.scenario.grid.step / step)
        rows = self.now - 1 - np.arange(count)[::-1] // each
        stamps = self.scenario.grid.stamps[max(self.now - 1, 0)]
        end = stamps.hour + stamps.minute / 60.0
        hours = end - (np.arange(count)[::-1] * step) / 3600.0
        above.plot(hours, record.zone_temperature[-count:] - _FREEZING, linewidth=0.8)
        lower, upper = (edge[rows] - _FREEZING for edge in (self.scenario.lower, self.scenario.upper))
        above.plot(hours, np.c_[lower.max(axis=1), upper.min(axis=1)], color="black", linestyle="--", linewidth=1.0)
        below.step(hours, record.electricity[-count:] / 1e3, label="electricity")
        if record.gas is not None:
            below.step(hours, record.gas[-count:] / 1e3, label="gas")
        below.legend(loc="upper left", fontsize="small")
        first = self.scenario.grid.stamps[max(self.now - 1, 0)]
        above.set_title(f"{first:%Y-%m-%d %H:%M}", fontsize="medium")
