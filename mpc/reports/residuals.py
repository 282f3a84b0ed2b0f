"""What a calibration's page says of what the model leaves: unmeasured heat, innovations, and the balance of heat."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from calibration.errors import FilterError, NotEnoughDataError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.filtered import FilterSettings, filter_interval
from calibration.estimation.heat_balance import CV_RMSE_LIMIT, NMBE_LIMIT, HeatBalance, HeatFit, heat_balance
from calibration.estimation.kalman import Filtered
from calibration.estimation.whiteness import Whiteness, whiteness
from calibration.evaluation.settings import Objective
from calibration.fit.result import CalibrationResult
from mpc.reports.figures.calibration import heat_lines, periodogram_bound, whiteness_panels
from mpc.reports.page import clock, counted, duration, significant, spell
from thermal._types import FloatArray
from thermal.model.case_replay import Inputs
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model

#: Zones up to which innovations are tested: the filter of a larger building takes minutes.
MOST_FILTERED = 40

#: Order of the reduced model of larger buildings, where only the balance of heat needs it.
LARGE_ORDER = 300

#: Rows of the tables of zones: the worst.
MOST_ROWS = 24

#: Errors over what the disturbance makes, in the mean square, above which physics is missing [-].
EXCESS_LIMIT = 1.5

#: Autocorrelation at one step below which innovations count as almost white, whatever tests of thousands say [-].
SMALL_CORRELATION = 0.1

#: A zone counts as heated or cooled from this mean on [W].
_LEAST_HEAT = 1.0


def diagnostics_content(result: CalibrationResult, grid: SymbolicModel, inputs: Inputs) -> dict[str, Any]:
    """Entries of the page: ``leftover`` in a sentence, ``innovations`` and ``heat`` with their tables and figures.

    Parameters
    ----------
    result : CalibrationResult
        From `calibrate`.
    grid : SymbolicModel
        Its model on the grid.
    inputs : Inputs
        The telemetry.
    """
    large = len(result.zones) > MOST_FILTERED
    model = reduced_model(grid, [result.theta], order=LARGE_ORDER if large else None)
    return {
        "leftover": _leftover_sentence(result.disturbance, result.excess, result.objective),
        "innovations": _innovations(result, model, inputs),
        "heat": _heat(result, model, inputs),
    }


def _leftover_sentence(disturbance: DisturbanceModel | None, excess: float, objective: Objective = "multi_step") -> str:
    """Say in plain words what heat nobody measured, and whether it makes the errors that there are.

    Parameters
    ----------
    disturbance : DisturbanceModel or None
        Unmeasured heat and sensor noise, tuned on the tuning intervals.
    excess : float
        Mean square of the tuning errors, or of what innovations pull at, over that which the disturbance makes [-].
    objective : {"multi_step", "innovations"}
        What was minimised.

    Examples
    --------
    >>> _leftover_sentence(DisturbanceModel(110.0, 7200.0, 0.03), 1.2)[:73]
    'Unmeasured heat of about 110 W a zone, remembered for 2 h, and sensor noi'
    """
    if disturbance is None:
        return "Unmeasured heat and sensor noise were not tuned: nothing says how large the errors should be."
    heat, noise = (float(np.median(v)) for v in (disturbance.deviation, disturbance.sensor_deviation))
    memory = "that drifts" if disturbance.random_walk else f"remembered for {_time(disturbance.time_constant)}"
    text = f"Unmeasured heat of about {significant(heat, 2)} W a zone, {memory}, and sensor noise of {noise:.2g} K "
    text += "make the one-step errors of the tuning intervals as likely as can be."
    # never below 1: the search for what is missing does not reward errors that happen to be small
    multi_step = objective == "multi_step"
    what = "errors of the runs are" if multi_step else "pulls of a day's innovations at the parameters are"
    if excess <= 1.0:
        return f"{text} The {what} no larger than these make."
    text += f" The {what}, in the mean square, {excess:.2g} times what these make"
    return text + (": physics is missing." if excess > EXCESS_LIMIT else ", which is close to what they should be.")


def _time(seconds: float) -> str:
    name, length = next((u for u in (("d", 86400.0), ("h", 3600.0)) if seconds >= u[1]), ("min", 60.0))
    return f"{seconds / length:.2g} {name}"


def _innovations(result: CalibrationResult, model: SymbolicModel, inputs: Inputs) -> dict[str, Any]:
    """Test the one-step innovations on held-out data, and the errors with the predictor-corrector; or say why not."""
    if result.disturbance is None:
        return {"reason": "Innovations are not tested: unmeasured heat and sensor noise were not tuned."}
    if len(result.zones) > MOST_FILTERED:
        return {
            "reason": f"Innovations are not tested: with {len(result.zones)} zones the filter takes minutes "
            f"(buildings of up to {MOST_FILTERED} are)."
        }
    try:
        filtered = _filter(result, result.disturbance, model, inputs)
    except (FilterError, NotEnoughDataError) as error:
        return {"reason": f"Innovations are not tested: {error}."}
    found = whiteness(filtered, result.zones)
    ranked = _ranked(found)
    if not ranked:
        return {"reason": "Innovations are not tested: no zone has enough of them."}
    judged = result.calibrated["held_out"]
    carried = {} if judged.carried is None else judged.carried.by_horizon
    bound = periodogram_bound(len(filtered.stamps))
    return {
        "verdict": _whiteness_sentence(found),
        "from": clock(filtered.stamps[0]),
        "to": clock(filtered.stamps[-1]),
        "step": duration(found.step),
        "lag": duration(found.lags[0] * found.step),
        "bound": f"{bound:.3f}",
        "rows": [_white_row(name, found) for name in ranked[:MOST_ROWS]],
        "count": len(ranked),
        "pictures": whiteness_panels(_shown(ranked, filtered, result.zones), found.step),
        "horizons": [[h, f"{mae:.3f}", f"{carried[h]:.3f}"] for h, mae in judged.by_horizon.items() if h in carried],
    }


def _filter(result: CalibrationResult, disturbance: DisturbanceModel, model: SymbolicModel, inputs: Inputs) -> Filtered:
    """Filter the longest held-out interval."""
    longest = max(result.held_out, key=lambda i: i.end - i.start)
    scheme, spin = result.settings.stepping, result.settings.spin_up_seconds
    filtering = FilterSettings(scheme, spin_up_seconds=spin)
    return filter_interval(model, result.theta, inputs, longest, disturbance, filtering)


def _ranked(found: Whiteness) -> list[str]:
    """Zones that could be tested, the largest distance of the cumulated periodogram first."""
    known = {name: z.periodogram_distance for name, z in found.zones.items() if np.isfinite(z.periodogram_distance)}
    return sorted(known, key=lambda name: -known[name])


def _shown(ranked: Sequence[str], filtered: Filtered, zones: Sequence[str]) -> dict[str, FloatArray]:
    """Innovations of the worst zone and of the one in the middle."""
    chosen = {f"{ranked[0]} (worst)": ranked[0]}
    if len(ranked) > 1:
        middle = ranked[len(ranked) // 2]
        chosen[f"{middle} (median)"] = middle
    series = filtered.standardised
    return {label: series[:, list(zones).index(zone)] for label, zone in chosen.items()}


def _white_row(name: str, found: Whiteness) -> tuple[str, int, float, str, float]:
    zone = found.zones[name]
    p = zone.ljung_box_p[0]
    return name, zone.count, zone.lag_one, "< 0.001" if p < 0.001 else spell(p, ".3f"), zone.periodogram_distance


def _whiteness_sentence(found: Whiteness) -> str:
    """Say in plain words what is left in the innovations.

    Parameters
    ----------
    found : Whiteness
        From `whiteness`, with at least one zone that could be tested.
    """
    lags = np.array([z.lag_one for z in found.zones.values() if np.isfinite(z.lag_one)])
    middle, rejected = float(np.median(lags)), len(found.rejected())
    number = f"{middle:+.2f}".replace("-", "−")
    if not rejected:
        return "The one-step errors are white: no test finds anything in them that could still be predicted."
    text = f"{rejected} of {counted(lags.size, 'zone')} fail a test of whiteness"
    size, largest = float(np.median(np.abs(lags))), float(np.max(np.abs(lags)))
    if size < SMALL_CORRELATION:
        return (
            f"{text}, but errors of successive steps correlate by ±{size:.2f} only in the median zone and by "
            f"±{largest:.2f} at most: in most zones little is left that could still be predicted from step to step."
        )
    if abs(middle) < SMALL_CORRELATION:
        return (
            f"{text}; errors of successive steps correlate by ±{size:.2f} in the median zone, with either sign: one "
            "disturbance common to the zones is too slow for some and too fast for others."
        )
    if middle > 0:
        return (
            f"{text}; errors of successive steps correlate by {number} in the median zone, so that an error tends to "
            "keep its sign, as it does where heat comes and goes more slowly than model and disturbance have it."
        )
    return (
        f"{text}; errors of successive steps correlate by {number} in the median zone, so that an error tends to turn "
        "its sign, as it does where sensors are noisier than tuned, or the model answers to heat too fast."
    )


def _heat(result: CalibrationResult, model: SymbolicModel, inputs: Inputs) -> dict[str, Any]:
    """Set needed against metered heat on the held-out intervals; or say why not."""
    try:
        balance = heat_balance(model, result.theta, inputs, result.held_out, result.settings.spin_up_seconds)
    except FilterError as error:
        return {"reason": f"The balance of heat is not drawn up: {error}."}
    if not np.isfinite(balance.needed).any():
        return {"reason": "The balance of heat is not drawn up: no whole hour has all its inputs and temperatures."}
    building, zones = balance.of_building(), balance.by_zone()
    series = zip(balance.zones, balance.metered.T, balance.needed.T, strict=True)
    measured = [(z, *heats, zones[z]) for z, *heats in series if np.isfinite(heats[1]).any()]
    worst = [_heat_row(*row) for row in sorted(measured, key=lambda row: -(row[3].cv_rmse if row[3] else -1.0))]
    return {
        "verdict": _heat_sentence(balance, building),
        "rows": [_heat_row("whole building", *balance.building(), building), *worst[:MOST_ROWS]],
        "count": len(measured),
        "limits": (f"{100 * NMBE_LIMIT:.0f}", f"{100 * CV_RMSE_LIMIT:.0f}"),
        "pictures": heat_lines(balance.stamps, *balance.building()),
    }


def _heat_row(name: str, metered: FloatArray, needed: FloatArray, fit: HeatFit | None) -> tuple[Any, ...]:
    known = np.isfinite(metered) & np.isfinite(needed)
    means = [float(v[known].mean()) if known.any() else None for v in (metered, needed)]
    ratios = (None, None) if fit is None or abs(fit.mean) < _LEAST_HEAT else (100 * fit.nmbe, 100 * fit.cv_rmse)
    return name, int(known.sum()), *means, *ratios


def _heat_sentence(balance: HeatBalance, building: HeatFit | None) -> str:
    """Say in plain words whether the model needs the heat that was metered.

    Parameters
    ----------
    balance : HeatBalance
        From `heat_balance`.
    building : HeatFit or None
        Of all measured zones together.
    """
    if building is None:
        metered, needed = (float(np.nanmean(v)) for v in (balance.metered, balance.needed))
        return (
            f"A zone was given {metered:.0f} W on average and the model needs {needed:.0f} W; of the whole building "
            "there is no ratio, for want of hours with every zone or because heating and cooling cancel."
        )
    word = "more" if building.nmbe < 0 else "less"
    text = f"To follow the measured temperatures, the model needs {100 * abs(building.nmbe):.1f} % {word} heat than "
    text += f"was metered, and its hourly error is {100 * building.cv_rmse:.0f} % of the mean: "
    return text + ("within" if building.met else "not within") + " the limits of ASHRAE Guideline 14 for hourly energy."
