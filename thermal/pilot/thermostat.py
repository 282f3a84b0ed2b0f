"""Thermostats and terminal units of a generated office, with schedules or pseudo-random binary set-points."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.signal import max_len_seq

from thermal._types import BoolArray, FloatArray, IntArray
from thermal.errors import ThermalError
from thermal.units import AIR_HEAT_CAPACITY

_FREEZING = 273.15  # K
_SATURDAY = 5  # day of the week, Monday is 0
_SATURDAY_STOP = 13.0  # h


@dataclass(frozen=True, eq=False)
class Thermostats:
    """Setpoint schedules of zones: occupied on weekdays, in some zones on Saturday mornings, set back otherwise.

    Parameters
    ----------
    heating, cooling : numpy.ndarray, shape (n_zone,)
        Setpoints while occupied [K], heating below cooling.
    heating_set_back, cooling_set_back : numpy.ndarray, shape (n_zone,)
        Setpoints otherwise [K].
    start, stop : numpy.ndarray, shape (n_zone,)
        Local hours of occupancy [h], 0 to 24.
    saturday : numpy.ndarray of bool, shape (n_zone,)
        Whether a zone is occupied from its start to 13:00 on Saturdays.
    """

    heating: FloatArray
    cooling: FloatArray
    heating_set_back: FloatArray
    cooling_set_back: FloatArray
    start: FloatArray
    stop: FloatArray
    saturday: BoolArray

    def occupied(self, times: pd.DatetimeIndex) -> BoolArray:
        """Tell when the schedules hold the occupied setpoints.

        Parameters
        ----------
        times : pandas.DatetimeIndex
            Local times, shape (n_time,).

        Returns
        -------
        numpy.ndarray of bool, shape (n_time, n_zone)
            True while occupied.
        """
        hour = (times.hour + times.minute / 60.0 + times.second / 3600.0).to_numpy()[:, np.newaxis]
        day = times.day_of_week.to_numpy()[:, np.newaxis]
        weekday = (day < _SATURDAY) & (hour >= self.start) & (hour < self.stop)
        morning = (day == _SATURDAY) & self.saturday & (hour >= self.start) & (hour < _SATURDAY_STOP)
        return np.asarray(weekday | morning, dtype=bool)

    def setpoints(self, times: pd.DatetimeIndex) -> tuple[FloatArray, FloatArray]:
        """Read the schedules.

        Parameters
        ----------
        times : pandas.DatetimeIndex
            Local times, shape (n_time,).

        Returns
        -------
        tuple of numpy.ndarray, shape (n_time, n_zone)
            Heating and cooling setpoints [K].
        """
        occupied = self.occupied(times)
        heating = np.where(occupied, self.heating, self.heating_set_back)
        return heating, np.where(occupied, self.cooling, self.cooling_set_back)


def draw_thermostats(seed: int, n_zone: int) -> Thermostats:
    """Draw schedules that differ between zones, as occupants set them.

    Heating 20-22 degC (ISO 7730, category B, winter: 22 degC and 2 K to either side) and cooling 1.5-3 K above it; set
    back to 16-18.5 degC and 26.5-29 degC; occupied from between 5:30 and 8:00 to between 17:00 and 20:00, in quarter
    hours, and in 15 % of the zones on Saturday mornings.

    Parameters
    ----------
    seed : int
        Same seed, same schedules; 0 or more.
    n_zone : int
        Number of zones, at least 1.

    Returns
    -------
    Thermostats
        Their schedules.

    Examples
    --------
    >>> thermostats = draw_thermostats(0, 3)
    >>> monday_noon = pd.DatetimeIndex(["2023-10-02 12:00"])
    >>> bool((thermostats.setpoints(monday_noon)[0] > 293.0).all())
    True
    """
    if seed < 0 or n_zone < 1:
        raise ThermalError(f"thermostats: expected a seed of 0 or more and a zone, found {seed} and {n_zone} zones")
    rng = np.random.default_rng(seed)

    def drawn(low: float, high: float) -> FloatArray:
        return np.asarray(rng.uniform(low, high, n_zone), dtype=float)

    heating = np.round(_FREEZING + drawn(20.0, 22.0), 2)
    return Thermostats(
        heating=heating,
        cooling=np.round(heating + drawn(1.5, 3.0), 2),
        heating_set_back=np.round(_FREEZING + drawn(16.0, 18.5), 2),
        cooling_set_back=np.round(_FREEZING + drawn(26.5, 29.0), 2),
        start=np.round(4.0 * drawn(5.5, 8.0)) / 4.0,
        stop=np.round(4.0 * drawn(17.0, 20.0)) / 4.0,
        saturday=rng.random(n_zone) < 0.15,
    )


@dataclass(frozen=True, eq=False)
class Terminals:
    """Terminal units that heat or cool by supply air, as far as its flow and temperature go.

    Parameters
    ----------
    design_heat : numpy.ndarray, shape (n_zone,)
        Largest heating and largest cooling power [W], positive.
    design_flow : numpy.ndarray, shape (n_zone,)
        Largest supply flow [kg/s], positive.
    minimum_flow : numpy.ndarray, shape (n_zone,)
        Smallest supply flow [kg/s], positive, up to the design flow.
    coldest, warmest : float
        Range of the discharge temperature [K] against the zone's temperature before a step. The default is a kelvin
        within 12-35 degC, so that the zone's drift during the step leaves it in that range.
    """

    design_heat: FloatArray
    design_flow: FloatArray
    minimum_flow: FloatArray
    coldest: float = _FREEZING + 13.0
    warmest: float = _FREEZING + 34.0

    def supply(self, demand: FloatArray, zone_temperature: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Meet a demand for heat with as little air as can carry it.

        Parameters
        ----------
        demand : numpy.ndarray, shape (n_zone,)
            Heat that the thermostats ask for [W], cooling negative.
        zone_temperature : numpy.ndarray, shape (n_zone,)
            Air temperature of the zones [K].

        Returns
        -------
        tuple of numpy.ndarray, shape (n_zone,)
            Supply flow [kg/s] and heat that it brings [W], ``flow * 1006 * (discharge - zone_temperature)`` with a
            discharge temperature in its range.
        """
        wanted = np.clip(demand, -self.design_heat, self.design_heat)
        limit = np.where(wanted >= 0.0, self.warmest, self.coldest) - zone_temperature
        # A zone beyond the range of the supply air cannot be heated (cooled) by it at all.
        usable = np.where(wanted >= 0.0, np.maximum(limit, 0.0), np.minimum(limit, 0.0))
        spread = np.maximum(np.abs(usable), 1e-9)
        flow = np.clip(np.abs(wanted) / (AIR_HEAT_CAPACITY * spread), self.minimum_flow, self.design_flow)
        most = flow * AIR_HEAT_CAPACITY * np.abs(usable)
        return np.asarray(flow, dtype=float), np.asarray(np.clip(wanted, -most, most), dtype=float)


def size_terminals(seed: int, floor_area: FloatArray, heat_flux: float = 60.0, minimum_share: float = 0.2) -> Terminals:
    """Size terminal units by floor area, with the scatter of real ones.

    Parameters
    ----------
    seed : int
        Same seed, same sizes; 0 or more.
    floor_area : numpy.ndarray, shape (n_zone,)
        Floor area of the zones [m2], positive.
    heat_flux : float
        Design heating and cooling power per floor area [W/m2], positive; every zone gets 0.85 to 1.15 times that.
        The default suits offices in a mild climate.
    minimum_share : float
        Smallest flow over design flow [-], above 0, up to 1. The default is usual for VAV boxes with reheat.

    Returns
    -------
    Terminals
        Units whose design flow brings the design power at 14 K above the zone: 34 degC into 20 degC.

    Raises
    ------
    ThermalError
        When an argument is out of its range.
    """
    if seed < 0 or not np.all(floor_area > 0.0) or not heat_flux > 0.0 or not 0.0 < minimum_share <= 1.0:
        expected = "a seed of 0 or more, areas and heat_flux above 0 and minimum_share in (0, 1]"
        found = f"{seed}, {np.min(floor_area)} m2, {heat_flux} W/m2 and {minimum_share}"
        raise ThermalError("terminals", expected, found)
    scatter = np.random.default_rng(seed).uniform(0.85, 1.15, len(floor_area))
    design_heat = heat_flux * scatter * floor_area
    design_flow = design_heat / (AIR_HEAT_CAPACITY * 14.0)
    return Terminals(design_heat, design_flow, minimum_share * design_flow)


_STREAM = 5  # of random numbers of a seed; thermostats have the seed itself
_BITS = 9  # of the shift register: 511 levels before the sequence repeats, 21 days of one hour
_CLOCK = (1.0, 4.0)  # h, between the time constants of the air and of the slabs
_AMPLITUDE = 1.5  # K, about both set-points: no more than a night set-back takes


@dataclass(frozen=True, eq=False)
class PrbsThermostats(Thermostats):
    """Thermostats whose two set-points go up and down together in a pseudo-random binary sequence, day and night.

    Such a signal is as good as white up to its clock, unlike a schedule, which repeats every day as the weather does;
    identification experiments in buildings use it (Bacher and Madsen 2011, doi:10.1016/j.enbuild.2011.02.005).

    Parameters
    ----------
    heating, cooling : numpy.ndarray, shape (n_zone,)
        Setpoints half-way between the two levels [K], heating below cooling.
    heating_set_back, cooling_set_back, start, stop, saturday : numpy.ndarray, shape (n_zone,)
        As in `Thermostats` [K], [h] and [-]; without effect here.
    clock : numpy.ndarray of int, shape (n_zone,)
        Time between two levels of a zone's sequence [s], positive.
    phase : numpy.ndarray of int, shape (n_zone,)
        Where each zone is in the sequence of 511 levels at the epoch [-].
    amplitude : float
        Distance of either level from these setpoints [K].
    """

    clock: IntArray
    phase: IntArray
    amplitude: float

    def setpoints(self, times: pd.DatetimeIndex) -> tuple[FloatArray, FloatArray]:
        """Read the sequences.

        Parameters
        ----------
        times : pandas.DatetimeIndex
            Local times, shape (n_time,).

        Returns
        -------
        tuple of numpy.ndarray, shape (n_time, n_zone)
            Heating and cooling setpoints [K].
        """
        levels = 2.0 * max_len_seq(_BITS)[0] - 1.0
        ticks = times.as_unit("s").asi8[:, np.newaxis] // self.clock + self.phase
        shift = self.amplitude * levels[ticks % levels.size]
        return self.heating + shift, self.cooling + shift


def draw_prbs_thermostats(seed: int, n_zone: int) -> PrbsThermostats:
    """Draw pseudo-random set-points about those of `draw_thermostats`.

    Parameters
    ----------
    seed : int
        Same seed, same set-points; 0 or more.
    n_zone : int
        Number of zones, at least 1.

    Returns
    -------
    PrbsThermostats
        Levels 1.5 K above and below the occupied set-points, each zone's with a clock of its own, 1 to 4 h in quarter
        hours: fast enough to show the air, slow enough to show what lies behind it.

    Examples
    --------
    >>> hours = pd.date_range("2023-01-09", periods=240, freq="h", tz="UTC")
    >>> heating, cooling = draw_prbs_thermostats(0, 2).setpoints(hours)
    >>> bool(np.allclose(np.ptp(heating, axis=0), 3.0))
    True
    """
    base = draw_thermostats(seed, n_zone)
    rng = np.random.default_rng([seed, _STREAM])
    clock = 900 * np.round(4.0 * rng.uniform(*_CLOCK, n_zone)).astype(np.int64)
    phase = rng.integers(2**_BITS - 1, size=n_zone)
    return PrbsThermostats(**vars(base), clock=clock, phase=phase, amplitude=_AMPLITUDE)
