"""What machines that setpoints lead buy together, where one source feeds them all and runs dearly at part load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mpc.errors import PlantError
from mpc.identify.curves import EMITTER, OUTDOOR, PER, Curve, interval_of
from mpc.identify.machines import FULL
from mpc.identify.maps import WORSE, Loads, MachineMap, design_of, led_heat, left_out_error, regress
from mpc.identify.shared import shares_of
from mpc.identify.telemetry import CARRIERS
from thermal._types import FloatArray

#: Squared error on left-out days over that of a map for each machine, from which on the source is believed [-].
_BETTER = 0.9

#: Part of full load that is compared with it [-].
_HALF = 0.5

#: Feature that says whether part load is dear.
_SQUARE = "command^2"


@dataclass(frozen=True)
class Source:
    """What a heat pump or boiler buys for all its terminals, over their load Q, a share of the sum of their full loads.

    ``P = b Q + c Q² + (d Q + f Q²) (T_out - 7 degC) / 10 K``. A source draws power whenever it runs, so that half of
    its heat takes more than half of its power (c < 0): terminals that want heat in turns keep it at part load, and at
    once they let it rest in between. Maps of each terminal alone cannot know that.

    Each parabola is held to be concave and not to fall, in any weather: c is 0 at most, b 0 at least, and beyond the
    load of its vertex nothing more is bought.

    Parameters
    ----------
    powers : mapping of str to Curve
        Of each kind that is bought [W].
    full : float
        Load up to which it is known, above 0: that of full load, the 98th percentile of what was seen [-].
    outdoor : float
        Median outdoor air of the telemetry [K].

    Raises
    ------
    PlantError
        When the full load is not above 0, or a kind is unknown.
    """

    powers: Mapping[str, Curve]
    full: float
    outdoor: float = OUTDOOR

    def __post_init__(self) -> None:
        PlantError.unless(self.full > 0.0, "source: full", "a load above 0", f"{self.full:g}")
        for kind in self.powers:
            PlantError.unless_known(kind, CARRIERS, "source: powers", "a kind that is bought")

    def at(self, load: FloatArray, outdoor: FloatArray | float) -> FloatArray:
        """Power of each kind, shape (..., n_carrier) [W]: beyond the load up to which it is known, by its slope there.

        Parameters
        ----------
        load : ndarray, shape (...)
            Of all machines [-].
        outdoor : ndarray, shape (...), or float
            Outdoor air [K].
        """
        powers = np.zeros((*np.shape(load), len(CARRIERS)))
        for kind in self.powers:
            by_load, squared, known = self._parabola(kind, outdoor)
            at = np.minimum(load, known)
            beyond = (by_load + 2.0 * squared * at) * (load - at)
            powers[..., CARRIERS.index(kind)] = by_load * at + squared * at**2 + beyond
        return powers

    def _parabola(self, kind: str, outdoor: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Coefficients of load and its square [W], and the load up to which they hold [-], in some weather."""
        terms, warmer = self.powers[kind].coefficients, (np.asarray(outdoor) - OUTDOOR) / PER
        by_load = np.maximum(terms.get("command", 0.0) + terms.get("outdoor", 0.0) * warmer, 0.0)
        squared = np.minimum(terms.get("command^2", 0.0) + terms.get("command^2 outdoor", 0.0) * warmer, 0.0)
        vertex = np.divide(by_load, -2.0 * squared, out=np.full(np.shape(warmer), np.inf), where=squared < 0.0)
        return by_load, squared, np.minimum(vertex, self.full)

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
            whole = self.at(full, outdoor)
            return np.zeros_like(whole), whole / full[:, None]
        at = np.clip(planned, 0.0, full)
        slope = np.zeros((len(at), len(CARRIERS)))
        for kind in self.powers:
            by_load, squared, known = self._parabola(kind, outdoor)
            slope[:, CARRIERS.index(kind)] = by_load + 2.0 * squared * np.minimum(at, known)
        return self.at(at, outdoor) - slope * at[:, None], slope

    @property
    def dearer(self) -> float:
        """What heat takes at half load over that at full load, at the median outdoor air of the telemetry [-]."""
        half, whole = (float(self.at(np.array(part * self.full), self.outdoor).sum()) for part in (_HALF, 1.0))
        return half / (_HALF * whole) if whole > 0.0 else 1.0


def find_source(
    loads: Loads, bought: Mapping[str, FloatArray], maps: Sequence[MachineMap], per_day: int
) -> tuple[Source | None, dict[str, float]]:
    """Find whether one source feeds all machines, by what they buy.

    It does where the load of all of them tells what is bought on left-out days better than the loads of each: better
    than a map for each, and better than the same parabola of each one's load, which has as many coefficients: being the
    smaller model is no merit. Its curvature must be told apart from none, and heat be dearer at half load than at full
    load. Machines that are commanded, or have sensors of their own power, have maps of their own.

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
    own = any(m.operation != "setpoint" or m.machine.power for m in maps)
    if len(maps) < 2 or not kinds or own:
        return None, {}
    shares = shares_of(led_heat(maps))
    total = loads.level @ shares
    together = Loads(total[:, None], loads.outdoor, np.full((len(total), 1), EMITTER))
    designs = [design_of(together, [0], standing=False), design_of(loads, range(len(maps))), _alike(loads, shares)]
    errors = np.sum([[left_out_error(design, bought[kind], per_day) for design in designs] for kind in kinds], axis=0)
    full = float(np.nanquantile(total, FULL))
    if full <= 0.0 or not errors[0] < _BETTER * errors[1:].min():
        return None, {}
    curves = {kind: regress(together, bought[kind], [0], standing=False) for kind in kinds}
    source = Source({kind: curve for kind, ((curve,), _) in curves.items()}, full, float(np.median(loads.outdoor)))
    squares = [curve for curve in source.powers.values() if _SQUARE in curve.coefficients]
    bent = any(interval_of(curve, _SQUARE)[1] < 0.0 for curve in squares)
    if not bent or source.dearer <= 1.0 + WORSE:
        return None, {}
    return source, {kind: base for kind, (_, base) in curves.items()}


def _alike(loads: Loads, shares: FloatArray) -> FloatArray:
    """Columns of machines of their own that are all alike, shape (n_time, 5): a constant, and sums over machines."""
    warmer = (loads.outdoor - OUTDOOR) / PER
    linear, squared = loads.level @ shares, loads.level**2 @ shares
    return np.column_stack([np.ones(len(linear)), linear, squared, linear * warmer, squared * warmer])
