"""What a plant did, on its own steps, and exact integrals of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.errors import MpcError
from thermal._types import FloatArray

_OF_ZONES, _OF_STEPS = ("zone_temperature", "co2"), ("electricity", "gas", "district_heating")


def excess(start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the positive part of a straight line over a step, and the share of the step in which it is positive.

    With a⁺ and b⁺ the positive parts of the ends, the line is positive over the share ``(a⁺ - b⁺) / (a - b)``, and its
    positive part has the mean ``(a⁺ + b⁺) / 2`` times that share. So a step in two halves gives the same integral as
    the whole, which the trapezoid of clipped values does not.

    Parameters
    ----------
    start, end : ndarray
        Excess over a limit at the ends of each step, negative within it [any].

    Returns
    -------
    mean : ndarray
        0 or more [as given].
    share : ndarray
        0 to 1 [-].
    """
    first, last, span = np.maximum(start, 0.0), np.maximum(end, 0.0), start - end
    still = span == 0.0
    share = np.where(still, first > 0.0, (first - last) / (span + still))
    return 0.5 * (first + last) * share, share


@dataclass(frozen=True, eq=False, repr=False)
class PlantRecord:
    """A run of a plant, one row a step of its own.

    Parameters
    ----------
    step : float
        Step of the plant [s].
    zone_temperature : ndarray, shape (n + 1, n_zone)
        At the edges of the steps, straight lines in between [K].
    electricity : ndarray, shape (n,)
        Power taken up by fans, pumps, chillers and heaters, means over the steps [W].
    gas : ndarray, shape (n,)
        Power of the fuel by its upper heating value, means over the steps [W]; None for a plant without.
    district_heating : ndarray, shape (n,)
        Heat bought, means over the steps [W]; None for a plant without.
    co2 : ndarray, shape (n + 1, n_zone)
        Carbon dioxide in the zones' air at the edges of the steps, as a share of volume [-]; None where it is not
        simulated.
    controller_seconds : ndarray, shape (n_action,)
        Time that the controller took for each action [s]; None when it was not measured.

    Raises
    ------
    MpcError
        When shapes do not fit or a value is not finite.
    """

    step: float
    zone_temperature: FloatArray
    electricity: FloatArray
    gas: FloatArray | None = None
    district_heating: FloatArray | None = None
    co2: FloatArray | None = None
    controller_seconds: FloatArray | None = None

    def __post_init__(self) -> None:
        temperature = np.asarray(self.zone_temperature, dtype=float)
        if temperature.ndim != 2 or len(temperature) < 2 or not self.step > 0:
            found = f"shape {temperature.shape}, a step of {self.step} s"
            raise MpcError("record: zone_temperature", "(n + 1, n_zone) over n positive steps", found)
        shapes = dict.fromkeys(_OF_STEPS, (len(temperature) - 1,)) | {"co2": temperature.shape}
        for name in ("zone_temperature", *shapes, "controller_seconds"):
            given = getattr(self, name)
            if given is None:
                continue
            values = np.asarray(given, dtype=float)
            shape = shapes.get(name, values.shape)
            MpcError.unless(values.shape == shape, f"record: {name}", f"shape {shape}", f"shape {values.shape}")
            if not np.isfinite(values).all():
                at = int(np.argmax(~np.isfinite(values).reshape(len(values), -1).all(axis=1)))
                raise MpcError(f"record: {name}", "finite numbers", f"{values[at]} in row {at}")
            object.__setattr__(self, name, values)

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.electricity)

    def to_frame(self, start: pd.Timestamp | None = None, zones: Sequence[str] = ()) -> pd.DataFrame:
        """Table of the run, one row an edge of its steps; the first row has temperatures only.

        Parameters
        ----------
        start : pandas.Timestamp, optional
            Start of the first step; by default rows are counted as time since then.
        zones : sequence of str
            Names of the zones; their numbers by default.

        Returns
        -------
        DataFrame, shape (n + 1, n_column)
            ``ZONE/zone_temperature`` [K] and ``ZONE/co2`` [-] at the edges, powers of the steps that end there [W].
        """
        edges = pd.to_timedelta(np.arange(self.n_steps + 1) * self.step, unit="s")
        names = zones or [str(k) for k in range(self.zone_temperature.shape[1])]
        columns = {f"{name}/{of}": getattr(self, of)[:, k] for of in _OF_ZONES if getattr(self, of) is not None
                   for k, name in enumerate(names)}  # fmt: skip
        powers = {of: getattr(self, of) for of in _OF_STEPS if getattr(self, of) is not None}
        columns |= {of: np.concatenate([[np.nan], power]) for of, power in powers.items()}
        return pd.DataFrame(columns, index=edges if start is None else start + edges)

    @classmethod
    def from_frame(cls, table: pd.DataFrame) -> PlantRecord:
        """Make a record of a table as `to_frame` has it.

        Parameters
        ----------
        table : DataFrame, shape (n + 1, n_column)
            On regular edges of steps; other columns are left alone.

        Raises
        ------
        MpcError
            When zone temperatures or electricity are missing, or edges are fewer than two or irregular.
        """
        steps = np.unique(np.diff(table.index.to_numpy()).astype("timedelta64[ns]"))
        of_zones = {of: [c for c in table if str(c).endswith(f"/{of}")] for of in _OF_ZONES}
        if len(steps) != 1 or not of_zones["zone_temperature"] or "electricity" not in table:
            expected, found = "regular edges, zone temperatures, electricity", f"{[*table][:6]}, {len(table)} rows"
            raise MpcError("record: table", expected, found)
        values = {of: table[columns].to_numpy(dtype=float) for of, columns in of_zones.items() if columns}
        values |= {of: table[of].to_numpy(dtype=float)[1:] for of in _OF_STEPS if of in table}
        return cls(step=float(steps[0] / np.timedelta64(1, "s")), **values)

    def __repr__(self) -> str:
        return f"PlantRecord({self.n_steps} steps of {self.step:g} s, {self.zone_temperature.shape[1]} zones)"
