"""What an identification leaves behind: the model, its telemetry, how well it predicts, and a page."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from calibration.estimation.state_space import REFERENCE
from calibration.results import Content
from mpc.identify.curves import EMITTER, OUTDOOR, Curve, interval_of
from mpc.identify.identify import Identified
from mpc.identify.maps import MachineMap
from mpc.identify.model import FILE, PlantModel
from mpc.identify.source import Source
from mpc.identify.water import SupplyWater
from mpc.kpi.kpis import Kpis, measure_kpis
from mpc.reports.display import write_results
from mpc.reports.figures.identify import course_pictures, error_pictures, map_pictures
from mpc.reports.means import Means
from mpc.reports.page import clock, duration, listed, percent, render, significant, spell
from mpc.studies.excited import Experiment
from thermal.units import from_si

#: What terms of a map are called.
_TERMS = {
    "standing": "at any speed above zero", "command": "times the load", "command^2": "times the load squared",
    "standing outdoor": "at any speed above zero, outdoor air 10 K warmer",
    "outdoor": "times the load, outdoor air 10 K warmer", "emitter": "times the load, floor 10 K warmer",
    "command^2 outdoor": "times the load squared, outdoor air 10 K warmer",
    "water": "times the load, water 10 K warmer", "stored": "while the water becomes 10 K warmer in a step",
}  # fmt: skip
_OPERATION = {
    "duty": "run at full load or not at all",
    "modulated": "run at part load",
    "setpoint": "run by the zone's own controller, by its setpoint",
}

#: Power that is worth a word [W].
_SEEN = 1.0


def write_identified(
    found: Identified, made: Experiment | None, out: str | Path, *, command: str = "", force: bool = False
) -> Path:
    """Write ``model.json``, ``identify.json``, ``telemetry.parquet`` and ``report.html``.

    Parameters
    ----------
    found : Identified
        Of `identify`.
    made : Experiment or None
        That led to it.
    out : str or Path
        Folder, made if need be.
    command : str
        That led to it, for the page.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.
    """
    return write_results(out, _files(found, made, command), force) / "report.html"


def identified_files(result: tuple[Identified, Experiment | None], plant: object) -> dict[str, Content]:
    """Files of one of many identified plants.

    Parameters
    ----------
    result : tuple of Identified and Experiment
        What was found, and what led to it.
    plant : object
        Its description.
    """
    return _files(*result, "")


def _files(found: Identified, made: Experiment | None, command: str) -> dict[str, Content]:
    return {
        FILE: found.model.to_dict(),
        "identify.json": identify_summary(found, made),
        "telemetry.parquet": found.telemetry.to_frame(),
        "report.html": render("identify", _content(found, made, command)),
    }


def experiment_kpis(made: Experiment) -> Kpis:
    """Measure what an experiment cost and how comfortable it was.

    Parameters
    ----------
    made : Experiment
        Of a plant.
    """
    return measure_kpis(made.run.record, made.scenario, control_step=made.telemetry.step)


def identify_summary(found: Identified, made: Experiment | None) -> dict[str, Any]:
    """Contents of ``identify.json``.

    Parameters
    ----------
    found : Identified
        Of `identify`.
    made : Experiment or None
        That led to it.
    """
    index, box = found.telemetry.frame.index, found.model.box
    names = [m.machine.name for m in found.model.maps]
    return {
        "plant": found.model.name, "start": index[0].isoformat(), "end": index[-1].isoformat(),
        "held_out_from": index[found.split].isoformat(), "errors": [e.to_dict() for e in found.errors],
        "machines": {
            m.machine.name: {
                "operation": m.operation, "standing_power": m.standing,
                "efficiency": None if found.model.source is not None or np.isnan(m.efficiency(1.0)) else
                {"full": m.efficiency(1.0), "half": m.efficiency(0.5)},
                "terms": [_told(row) for row in _terms(m)],
            }
            for m in found.model.maps
        },
        "source": None if found.model.source is None else {
            "full_load": found.model.source.full, "least_load": found.model.source.least,
            "half_over_full": found.model.source.dearer, "outdoor": found.model.source.outdoor,
            "terms": [_told(row) for row in _source_terms(found.model.source)],
        },
        "water": None if found.model.water is None else {
            "actuator": found.model.water.actuator.name, "temperature": found.model.water.temperature,
            "dearer_by_kelvin": _dearer(found.model), "terms": [_told(row) for row in _water_terms(found.model.water)],
        },
        "air_handler": None if found.model.air_handler is None else {
            "supply": found.model.air_handler.supply, "powers": dict(found.model.air_handler.powers),
            "conductances": dict(zip(names, found.model.air_handler.conductances, strict=True)),
        },
        "time_constants_hours": (box.time_constants / 3600.0).tolist(), "heat_loss": box.heat_loss.tolist(),
        "unmeasured_heat": box.disturbance.to_dict(), "notes": list(found.notes),
        "experiment": None if made is None else {
            "kpis": experiment_kpis(made).to_dict(), "handed_back": made.handed_back,
        },
    }  # fmt: skip


def identify_verdict(found: Identified, made: Experiment | None) -> str:
    """Say in plain words what is known of a plant.

    Parameters
    ----------
    found : Identified
        Of `identify`.
    made : Experiment or None
        That led to it.
    """
    steps = len(found.telemetry.frame)
    text = f"From {duration(steps * found.telemetry.step)} of telemetry: "
    if found.errors:
        last = found.errors[-1]
        best = min(last.persistence, last.arx)
        word = "better" if last.grey_box < best else "no better"
        text += (
            f"the model predicts the zones {duration(last.lead)} ahead to {last.grey_box:.2f} K on days it has not "
            f"seen, {word} than the best simple model ({best:.2f} K). "
        )
    else:
        text += "too short to hold days out, so that nothing is known of its errors. "
    for operation, words in _OPERATION.items():
        names = [m.machine.name for m in found.model.maps if m.operation == operation]
        if names:
            text += f"{listed(names)} {'are' if len(names) > 1 else 'is'} to be {words}. "
    standing = [(m.machine.name, m.standing) for m in found.model.maps if m.standing > _SEEN]
    if standing:
        text += f"{listed([f'{name} draws {significant(w, 2)} W' for name, w in standing])} at any speed. "
    if found.model.source is not None:
        text += f"One source feeds them all: at half load its heat takes {percent(found.model.source.dearer - 1.0)} "
        text += "more than at full load. "
    if found.model.water is not None:
        text += f"{found.model.water.actuator.name} is decided too: at full load a kelvin of it is worth "
        text += f"{100.0 * _dearer(found.model):.1f} % of what is bought. "
    text += _air_handler_words(found.model)
    if made is not None:
        k = experiment_kpis(made)
        text += (
            f"The experiment spent {k.cost_tot * k.floor_area:.2f} {k.currency} on energy; zones were outside of their "
            f"band by {k.tdis_tot:.2f} K h on average, and the plant had its machines back for "
            f"{percent(made.handed_back)} of the time."
        )
    return text.strip()


def identify_means(found: Identified) -> Means:
    """Say what an identified model means for who runs the plant.

    Parameters
    ----------
    found : Identified
        Of `identify`.
    """
    answer = f"The library has learnt how {found.model.name} warms up and cools down and what its machines draw, from "
    answer += f"{duration(len(found.telemetry.frame) * found.telemetry.step)} of telemetry."
    if not found.errors:
        trust = "Nothing is known of its errors: the telemetry was too short to hold days out."
    else:
        last = found.errors[-1]
        simple = min(last.persistence, last.arx)
        trust = f"On days that it has not seen it is {last.grey_box:.2f} degrees C off {duration(last.lead)} ahead; "
        trust += f"the best simple forecast is {simple:.2f} off"
        trust += "." if last.grey_box < simple else ": better, so give it more days before you rely on it."
    then = "See what it saves against the plant's own control, with DIR the folder of this page: buildingmpc compare "
    return Means(answer, trust, f"{then}PLANT.yaml --model DIR --out compared.")


def identify_rows(found: Identified) -> list[tuple[str, float, float, float]]:
    """Rows of the table of errors.

    Parameters
    ----------
    found : Identified
        Of `identify`.
    """
    return [(duration(e.lead), e.grey_box, e.arx, e.persistence) for e in found.errors]


def map_rows(model: PlantModel) -> list[list[str]]:
    """Rows of the table of maps: machine, what, term, value and interval; without terms of less than a watt.

    Parameters
    ----------
    model : PlantModel
        Identified.
    """
    rows = [row for m in model.maps for row in _terms(m)]
    rows += _source_terms(model.source) if model.source is not None else []
    rows += _water_terms(model.water) if model.water is not None else []
    return [
        [name, what, term, f"{spell(value, ',.0f')} W", f"{spell(low, ',.0f')} to {spell(high, ',.0f')} W"]
        for name, what, term, value, (low, high) in rows
        if max(abs(low), abs(high)) >= _SEEN
    ]


#: Machine, what, term, value and interval of a coefficient [W].
_Term = tuple[str, str, str, float, tuple[float, float]]


def _terms(m: MachineMap) -> list[_Term]:
    """List the coefficients of a machine."""
    return _terms_of(m.machine.name, {"heat" if m.machine.meter else "heat, in what is bought": m.heat, **m.powers})


def _source_terms(source: Source) -> list[_Term]:
    """List the coefficients of a source."""
    return _terms_of("one source of all", source.powers)


def _water_terms(water: SupplyWater) -> list[_Term]:
    """List the coefficients of supply water."""
    return _terms_of(water.actuator.name, water.powers)


def _dearer(model: PlantModel) -> float:
    """Share of what is bought at full load that a kelvin of supply water is worth [-]."""
    if model.water is None:
        return 0.0
    full, outdoor = np.ones(len(model.maps)), model.maps[0].rating[0] if model.source is None else model.source.outdoor
    bought = model.bought(np.zeros(model.box.capacity.size), full, outdoor, model.water.temperature)
    return float(model.water.by_kelvin.sum() / bought.sum())


def _terms_of(name: str, curves: Mapping[str, Curve]) -> list[_Term]:
    return [
        (name, what.replace("_", " "), _TERMS[term], value, interval_of(curve, term))
        for what, curve in curves.items()
        for term, value in curve.coefficients.items()
    ]


def _told(row: _Term) -> dict[str, Any]:
    """Coefficient for a file."""
    return dict(zip(("what", "term", "value", "interval"), row[1:], strict=True))


def _source_words(source: Source) -> str:
    """Say at which weather a source's terms are, and below which load it goes on and off."""
    return (
        f"Those of the source at {source.outdoor - 273.15:.0f} °C; below a load of {source.least:g} it goes on and off."
    )


def _air_handler_words(model: PlantModel) -> str:
    """Say what an air handler does to rooms that nobody heats; nothing without one."""
    handler = model.air_handler
    if handler is None:
        return ""
    cold = from_si(handler.supply, "degC", "temperature")
    lost = sum(handler.conductances) * (REFERENCE - handler.supply)
    words = f"One air handler blows {float(cold):.1f} °C at all of these rooms while it runs, and takes "
    return words + f"{significant(lost / 1e3, 2)} kW from them at 20 °C; it runs for each of them that is heated. "


def _water_words(water: SupplyWater) -> str:
    """Say at which water the coefficients are, and what cools."""
    colder = "" if water.sign > 0.0 else ", of which colder is dearer"
    return f"All are those with water of {water.temperature - 273.15:.0f} °C{colder}."


def _weather(outdoor: float, emitter: float) -> str:
    return f"{outdoor - 273.15:.0f} °C outdoors and {emitter - 273.15:.0f} °C of the floor"


def _content(found: Identified, made: Experiment | None, command: str) -> dict[str, Any]:
    box, index = found.model.box, found.telemetry.frame.index
    disturbance = box.disturbance
    machines = [
        (m.machine.name, _OPERATION[m.operation],
         listed(m.machine.serves) if len(m.machine.serves) < 5 else "all zones",
         m.machine.meter or "not measured", significant(m.standing, 2) if m.standing > _SEEN else "0",
         *("of the source" if found.model.source is not None else significant(m.efficiency(u), 3) for u in (1.0, 0.5)))
        for m in found.model.maps
    ]  # fmt: skip
    zones = [
        (zone, significant(box.heat_loss[k], 3),
         *(significant(box.capacity[n * len(box.zones) + k] / 3.6e6, 3) for n in range(4)))
        for k, zone in enumerate(box.zones)
    ]  # fmt: skip
    cards = [(f"{e.grey_box:.2f} K", f"mean error {duration(e.lead)} ahead, days held out") for e in found.errors]
    if made is not None:
        k = experiment_kpis(made)
        cards += [(f"{k.cost_tot * k.floor_area:,.2f} {k.currency}", "energy during the experiment"),
                  (f"{k.tdis_tot:.2f} K h", "outside of the comfort band, mean zone")]  # fmt: skip
    return {
        "title": f"Model of {found.model.name}", "means": identify_means(found), "cards": cards,
        "verdict": identify_verdict(found, made),
        "subtitle": f"{clock(index[0])} to {clock(index[-1])}, held out from {clock(index[found.split])} on",
        "errors": [[duration(e.lead), f"{e.grey_box:.3f}", spell(e.bias, "+.3f"), f"{e.arx:.3f}",
                    f"{e.persistence:.3f}", str(e.count)] for e in found.errors],
        "machines": machines, "maps": map_rows(found.model), "zones": zones, "notes": found.notes, "command": command,
        "slowest": significant(float(np.max(box.time_constants)) / 3600.0, 3),
        "unmeasured": significant(float(np.sqrt(np.mean(np.asarray(disturbance.deviation) ** 2))), 2),
        "lasting": significant(disturbance.time_constant / 3600.0, 2),
        "at": _weather(*found.model.maps[0].rating), "coefficients_at": _weather(OUTDOOR, EMITTER),
        "source": None if found.model.source is None else _source_words(found.model.source),
        "water": None if found.model.water is None else _water_words(found.model.water),
        "error_pictures": error_pictures(found), "map_pictures": map_pictures(found), "course": course_pictures(found),
    }  # fmt: skip
