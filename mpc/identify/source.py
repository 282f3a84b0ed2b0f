"""What machines that setpoints lead buy together, where one source feeds them all and runs dearly at part load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mpc.identify.curves import EMITTER, OUTDOOR, Curve
from mpc.identify.machines import FULL
from mpc.identify.maps import WORSE, Loads, MachineMap, led_heat, left_out_error, regress
from mpc.identify.shared import shares_of
from mpc.identify.telemetry import CARRIERS
from thermal._types import FloatArray

#: Squared error on left-out days over that of a map for each machine, from which on the source is believed [-].
_BETTER = 0.9

#: Part of full load that is compared with it [-].
_HALF = 0.5

#: Difference of loads that slopes are taken over [-].
_STEP = 0.01


@dataclass(frozen=True)
class Source:
    """What a heat pump or boiler buys for all its terminals, over their load Q, a share of the sum of their full loads.

    ``P = b Q + c Q² + (d Q + f Q²) (T_out - 7 degC) / 10 K``. A source draws power whenever it runs, so that half of
    its heat takes more than half of its power (c < 0): terminals that want heat in turns keep it at part load, and at
    once they let it rest in between. Maps of each terminal alone cannot know that.

    Parameters
    ----------
    powers : mapping of str to Curve
        Of each kind that is bought [W].
    full : float
        Load up to which it is known: that of full load, the 98th percentile of what was seen [-].
    """

    powers: Mapping[str, Curve]
    full: float

    def at(self, load: FloatArray, outdoor: FloatArray | float) -> FloatArray:
        """Power of each kind, shape (..., n_carrier) [W]: beyond the load up to which it is known, by its slope there.

        Parameters
        ----------
        load : ndarray, shape (...)
            Of all machines [-].
        outdoor : ndarray, shape (...), or float
            Outdoor air [K].
        """
        known = np.minimum(load, self.full)
        return self._curves(known, outdoor) + self._slopes(known, outdoor) * np.asarray(load - known)[..., None]

    def lines(
        self, outdoor: FloatArray, most: FloatArray, planned: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Power of each kind as a line over the load: at no load and by load, each of shape (N, n_carrier) [W].

        The tangent at the load that is planned, or, where none is, the line through nothing and full load.

        Parameters
        ----------
        outdoor : ndarray, shape (N,)
            Outdoor air [K].
        most : ndarray, shape (N,)
            Largest load of all machines [-].
        planned : ndarray, shape (N,), optional
            Load of all machines [-].

        Examples
        --------
        >>> source = Source({"electricity": Curve({"command": 6e3, "command^2": -2e3}, {})}, 1.0)
        >>> at_none, by_load = source.lines(np.full(2, 280.15), np.ones(2), np.array([0.0, 0.5]))
        >>> at_none[:, 0].round(6).tolist(), by_load[:, 0].round(3).tolist()
        ([0.0, 500.0], [6000.0, 4000.0])
        """
        full = np.minimum(most, self.full)
        if planned is None:
            whole = np.maximum(self.at(full, outdoor), 0.0)
            return np.zeros_like(whole), whole / full[:, None]
        at = np.clip(planned, 0.0, full)
        slope = self._slopes(at, outdoor)
        return self.at(at, outdoor) - slope * at[:, None], slope

    def _curves(self, load: FloatArray, outdoor: FloatArray | float) -> FloatArray:
        """Evaluate the parabolas, shape (..., n_carrier) [W]."""
        powers = np.zeros((*np.shape(load), len(CARRIERS)))
        for carrier, curve in self.powers.items():
            powers[..., CARRIERS.index(carrier)] = curve(0.0, load, outdoor, EMITTER)
        return powers

    def _slopes(self, load: FloatArray, outdoor: FloatArray | float) -> FloatArray:
        """Slopes of the parabolas, 0 where they fall, shape (..., n_carrier) [W]; central differences are exact."""
        more, less = (self._curves(load + d, outdoor) for d in (_STEP, -_STEP))
        return np.maximum((more - less) / (2.0 * _STEP), 0.0)

    def power_by_load(self, part: float, outdoor: float = OUTDOOR) -> float:
        """All that is bought over the load, at a part of full load [W].

        Parameters
        ----------
        part : float
            Of full load, above 0 [-].
        outdoor : float
            Outdoor air [K].
        """
        return float(self.at(np.array(part * self.full), outdoor).sum()) / (part * self.full)


def find_source(
    loads: Loads, bought: Mapping[str, FloatArray], maps: Sequence[MachineMap], per_day: int
) -> tuple[Source | None, dict[str, float]]:
    """Find whether one source feeds all machines, by what they buy.

    It does where the load of all of them tells what is bought on left-out days better than the loads of each, and where
    that is dearer at half load than at full load. Machines that are commanded, or have sensors of their own power, have
    maps of their own.

    Parameters
    ----------
    loads : Loads
        Of the machines [-].
    bought : mapping of str to ndarray
        Power of each kind that the plant buys, shape (n_time,) [W].
    maps : sequence of MachineMap
        Of the machines.
    per_day : int
        Steps of a day.

    Returns
    -------
    Source or None
        None where it is not one.
    dict of str to float
        Power of each kind that no machine explains [W].
    """
    kinds = [kind for kind in bought if all(kind in found.powers for found in maps)]
    if len(maps) < 2 or not kinds or any(m.operation != "setpoint" or m.own is not None for m in maps):
        return None, {}
    total = loads.level @ shares_of(led_heat(maps))
    together = Loads(total[:, None], loads.outdoor, np.full((len(total), 1), EMITTER))
    everyone, errors = range(len(maps)), np.zeros(2)
    for kind in kinds:
        errors += [
            left_out_error(together, bought[kind], [0], per_day, standing=False),
            left_out_error(loads, bought[kind], everyone, per_day),
        ]
    if not errors[0] < _BETTER * errors[1]:
        return None, {}
    curves = {kind: regress(together, bought[kind], [0], standing=False) for kind in kinds}
    full = float(np.nanquantile(total, FULL))
    source = Source({kind: curve for kind, ((curve,), _) in curves.items()}, full)
    outdoor = float(np.median(loads.outdoor))
    if full <= 0.0 or source.power_by_load(_HALF, outdoor) <= (1.0 + WORSE) * source.power_by_load(1.0, outdoor):
        return None, {}
    return source, {kind: base for kind, (_, base) in curves.items()}
