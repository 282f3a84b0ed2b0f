"""What machines that setpoints lead buy together, where one source feeds them all and runs dearly at part load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mpc.errors import PlantError
from mpc.identify.curves import OUTDOOR, PER, Curve, interval_of
from mpc.identify.machines import FULL
from mpc.identify.maps import WORSE, MachineMap, led_heat
from mpc.identify.regression import BETTER, Loads, curve_of, design_of, least_squares, left_out_error
from mpc.identify.shared import shares_of
from mpc.identify.telemetry import CARRIERS
from thermal._types import FloatArray

#: Part of full load that is compared with it [-].
_HALF = 0.5

#: Loads below which a source may go on and off [-]: those that are tried. Heat pumps and chillers modulate down to 0.1
#: to 0.5 of what they have, which is less than the sum of their terminals.
LEAST = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)

#: What is regressed on, see `Source`.
_STANDING = "standing"
_FEATURES = ("command", _STANDING, "outdoor", "standing outdoor")


@dataclass(frozen=True)
class Source:
    """What a heat pump, chiller or boiler buys for all its terminals, over their load Q.

    ``P = b Q + s r + (d Q + f r) (T_out - T) / 10 K`` with ``r = min(Q / q, 1)``, the share of the time that it runs,
    and Q a share of the sum of the terminals' full loads. A source draws power whenever it runs (s), whatever it gives,
    and below its least load q it goes on and off. So half of its heat takes more than half of its power, and heat that
    is taken while it runs anyhow costs b alone: terminals that want heat in turns keep it running, and at once they let
    it rest in between. Maps of each terminal alone cannot know that.

    It is held concave and rising in any weather: b and s are 0 at least.

    Parameters
    ----------
    powers : mapping of str to Curve
        Of each kind that is bought: b, s, d and f, called ``command``, ``standing``, ``outdoor`` and ``standing
        outdoor`` [W].
    full : float
        Full load, the 98th percentile of what was seen, above 0 [-].
    least : float
        q, above 0 [-].
    outdoor : float
        T, the median outdoor air of the telemetry [K].

    Raises
    ------
    PlantError
        When a load is not above 0, or a kind is unknown.
    """

    powers: Mapping[str, Curve]
    full: float
    least: float
    outdoor: float = OUTDOOR

    def __post_init__(self) -> None:
        for name, load in (("full", self.full), ("least", self.least)):
            PlantError.unless(load > 0.0, f"source: {name}", "a load above 0", f"{load:g}")
        for kind in self.powers:
            PlantError.unless_known(kind, CARRIERS, "source: powers", "a kind that is bought")

    def at(self, load: FloatArray, outdoor: FloatArray | float) -> FloatArray:
        """Power of each kind, shape (..., n_carrier) [W].

        Parameters
        ----------
        load : ndarray, shape (...)
            Of all machines [-].
        outdoor : ndarray, shape (...), or float
            Outdoor air [K].
        """
        by_load, standing = self._weights(outdoor)
        runs = np.minimum(load / self.least, 1.0)
        return np.asarray(by_load * np.asarray(load)[..., None] + standing * runs[..., None])

    def _weights(self, outdoor: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Power by load and while it runs, in some weather, shape (..., n_carrier) each [W]."""
        warmer = (np.asarray(outdoor) - self.outdoor) / PER
        found = np.zeros((2, *warmer.shape, len(CARRIERS)))
        for kind, curve in self.powers.items():
            by_load, standing, warm, warm_standing = (curve.coefficients.get(name, 0.0) for name in _FEATURES)
            found[0, ..., CARRIERS.index(kind)] = by_load + warm * warmer
            found[1, ..., CARRIERS.index(kind)] = standing + warm_standing * warmer
        return tuple(np.maximum(found, 0.0))

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
        >>> source = Source({"electricity": Curve({"command": 4e3, "standing": 1e3}, {})}, 1.0, 0.2)
        >>> at_none, by_load = source.lines(np.full(2, 280.15), np.ones(2), np.array([0.0, 0.5]))
        >>> at_none[:, 0].round(6).tolist(), by_load[:, 0].round(3).tolist()
        ([0.0, 1000.0], [9000.0, 4000.0])
        """
        if planned is None:
            full = np.minimum(most, self.full)
            whole = self.at(full, outdoor)
            return np.zeros_like(whole), whole / full[:, None]
        by_load, standing = self._weights(outdoor)
        runs = (planned >= self.least)[:, None]
        return np.where(runs, standing, 0.0), by_load + np.where(runs, 0.0, standing / self.least)

    @property
    def dearer(self) -> float:
        """What heat takes at half load over that at full load, at the median outdoor air of the telemetry [-]."""
        half, whole = (float(self.at(np.array(part * self.full), self.outdoor).sum()) for part in (_HALF, 1.0))
        return half / (_HALF * whole) if whole > 0.0 else 1.0


def find_source(
    loads: Loads, bought: Mapping[str, FloatArray], maps: Sequence[MachineMap], per_day: int, *, told: bool = False
) -> tuple[Source | None, dict[str, float]]:
    """Find whether one source feeds all machines, by what they buy.

    It does where the load of all of them tells what is bought on left-out days better than the loads of each: better
    than a map for each, and better than sources of their own that are all alike, which have as many coefficients: being
    the smaller model is no merit. Where a description says that one source feeds them, it is taken unless it does worse
    than these by as much. What it draws while it runs must be told apart from nothing, and heat be dearer at
    half load than at full load. Machines that are commanded, or have sensors of their own power, have maps of their
    own.

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
    told : bool
        Whether the description says that one source feeds all machines.

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
    shares, middle = shares_of(led_heat(maps)), float(np.median(loads.outdoor))
    total = loads.level @ shares
    full = float(np.nanquantile(total, FULL))

    def error(design: FloatArray) -> float:
        return float(np.sum([left_out_error(design, bought[kind], per_day) for kind in kinds]))

    designs = {least: source_design(total[:, None], np.ones(1), loads.outdoor - middle, least) for least in LEAST}
    errors = {least: error(design) for least, design in designs.items()}
    alike = min(error(source_design(loads.level, shares, loads.outdoor - middle, least)) for least in LEAST)
    least = min(errors, key=errors.__getitem__)
    better = 1.0 / BETTER if told else BETTER
    if full <= 0.0 or not errors[least] < better * min(alike, error(design_of(loads, range(len(maps))))):
        return None, {}
    curves, base = {}, {}
    for kind in kinds:
        rows = np.isfinite(total) & np.isfinite(bought[kind])
        found, deviations = least_squares(designs[least][rows], bought[kind][rows])
        curves[kind], base[kind] = curve_of(("", *_FEATURES), found, deviations), float(found[0])
    source = Source(curves, full, least, middle)
    stands = any(interval_of(curve, _STANDING)[0] > 0.0 for curve in curves.values())
    return (source, base) if stands and source.dearer > 1.0 + WORSE else (None, {})


def source_design(level: FloatArray, shares: FloatArray, beyond: FloatArray, least: float) -> FloatArray:
    """Columns of a regression: a constant, and the features of `Source` summed over sources, shape (n_time, 5) [-].

    Parameters
    ----------
    level : ndarray, shape (n_time, n)
        Loads of each [-].
    shares : ndarray, shape (n,)
        Of each in the load of all [-].
    beyond : ndarray, shape (n_time,)
        Outdoor air less the temperature that coefficients are told at [K].
    least : float
        Load below which a source goes on and off [-].
    """
    load, runs = level @ shares, np.minimum(level / least, 1.0) @ shares
    return np.column_stack([np.ones(len(load)), load, runs, load * beyond / PER, runs * beyond / PER])
