"""Scores of blind trials: answers written before the seals were opened, against what the trials truly hold."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from statsmodels.stats.proportion import proportion_confint

#: Least gap over the twin without the effect for which a trial counts [K].
LEAST_GAP = 0.05

_VERDICTS = ("no_gap", "named", "group", "unexplained")


def _same(number: float) -> float:
    return number


def _in_minutes(seconds: float) -> float:
    return seconds / 60.0


def _to_add(read_too_much: float) -> float:
    """Share of the metered heat that is missing, from the share by which the meter reads too much."""
    return -read_too_much / (1.0 + read_too_much)


#: Where generator and catalogue have one number for how strong an effect is: its name there, the names whose sum it is
#: here, and what makes one of the other.
_STRENGTH: Mapping[str, tuple[str, tuple[str, ...], Callable[[float], float]]] = {
    "interfloor_exchange": ("u_value_W_m2_K", ("interfloor_u_value",), _same),
    "ground_exchange": ("u_value_W_m2_K", ("ground_u_value",), _same),
    "roof_exchange": ("u_value_W_m2_K", ("roof_u_value",), _same),
    "neighbour": ("u_value_W_m2_K", ("neighbour_u_value",), _same),
    "internal_gains": ("power_W_m2", ("internal_gain", "base_load", "equipment_gain", "scheduled_gain"), _same),
    "latent_load": ("power_W_m2", ("latent_load",), _same),
    "valve_leak": ("power_W_m2", ("valve_leak",), _same),
    "capacity_limit": ("lost_share", ("capacity_lost",), _same),
    "solar_opaque": ("absorptance", ("solar_absorptance",), _same),
    "flow_gain": ("gain", ("flow_gain",), _to_add),
    "sensor_bias": ("bias_K", ("sensor_bias",), _same),
    "sensor_lag": ("time_constant_s", ("sensor_lag",), _in_minutes),
}

#: Confidence of the intervals of shares [-].
_LEVEL = 0.95

#: Ends of the classes of probabilities in the reliability table, and of the classes of strength [-].
_PROBABILITIES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
_STRENGTHS = (0.35, 0.7, 1.1, 1.6)


@dataclass(frozen=True)
class Trial:
    """One trial: what it holds, and what the diagnosis answered.

    Parameters
    ----------
    name : str
        Of the trial.
    kind : str
        ``null``, ``single``, ``pair`` or ``outside``.
    truths : tuple of frozenset of str
        Names that are right for each effect that it holds.
    labels : tuple of str
        The effects as their generator calls them.
    strength : float
        Of the first effect, over a typical one [-].
    zones : frozenset of str
        Where the first effect is; empty for the whole building.
    unexplained_is_right : bool
        Whether ``unexplained`` counts as a right verdict.
    twins : tuple of float
        Held-out error of the calibrated baseline on the twin without each of the effects [K]; NaN where there is none.
    answer : mapping
        Contents of ``diagnosis.json``.
    confirmation : bool
        Whether its seed is one that nothing is tuned on.
    numbers : mapping
        Of the first effect, as its generator has them.
    world : str
        Which maker's buildings it is of.
    building : str
        What kind of building it is, as its maker calls it.
    """

    name: str
    kind: str
    truths: tuple[frozenset[str], ...]
    labels: tuple[str, ...]
    strength: float
    zones: frozenset[str]
    unexplained_is_right: bool
    twins: tuple[float, ...]
    answer: Mapping[str, Any]
    confirmation: bool = False
    numbers: Mapping[str, Any] = field(default_factory=dict)
    world: str = "office"
    building: str = ""

    @property
    def shown(self) -> tuple[frozenset[str], ...]:
        """Names that are right for each effect that leaves a gap which calibration cannot hide."""
        mae = gap_of(self.answer)
        return tuple(t for t, twin in zip(self.truths, self.twins, strict=True) if not mae - twin <= LEAST_GAP)

    @property
    def counted(self) -> bool:
        """Whether an effect leaves a gap; nulls always count."""
        return self.kind == "null" or bool(self.shown)

    @property
    def named(self) -> bool:
        """Whether the verdict names a cause."""
        return self.answer["verdict"] in ("named", "group")

    def ranked(self, count: int) -> list[str]:
        """Return the first effects of the answer.

        Parameters
        ----------
        count : int
            How many.
        """
        return [s["effect"] for s in self.answer["which"][:count]]

    def holds(self, effects: Iterable[str]) -> bool:
        """Whether some of the effects is one that the trial holds.

        Parameters
        ----------
        effects : iterable of str
            Ids.
        """
        return any(e in truth for truth in self.truths for e in effects)

    @property
    def right_first(self) -> bool:
        """Whether the best guess is right."""
        return self.holds(self.ranked(1))

    @property
    def right_group(self) -> bool:
        """Whether the group of the best guess holds the truth."""
        return self.holds(self.answer["which"][0]["group"]) or self.right_first

    @property
    def wrong_name(self) -> bool:
        """Whether a cause is named that is none, nor in one group with one."""
        return self.named and not self.right_group

    @property
    def further_wrong(self) -> bool:
        """Whether something is accepted beside the first name that is not there; what is a building's own may be."""
        first, *others = (s["effect"] for s in self.answer["which"])
        accepted = {e for step in self.answer["how_far"] for e in step["effects"]} & set(others) - {first}
        return any(not self.holds([e]) for e in accepted)

    @property
    def covered(self) -> bool:
        """Whether the 90 % set holds all effects that leave a gap."""
        inside = self.answer["set90"]
        return all(any(e in truth for e in inside) for truth in self.shown)

    @property
    def strength_found(self) -> float | None:
        """Strength of the first effect that was found, over the true one [-]; None where it has not one number."""
        known = _STRENGTH.get(self.labels[0]) if self.labels else None
        found = next((w for w in self.answer["which"] if self.labels and w["effect"] == self.labels[0]), None)
        if known is None or found is None or known[0] not in self.numbers:
            return None
        key, names, here = known
        total: dict[str, float] = {}
        for name, told in found["parameters"].items():
            base, _, member = name.partition("@")
            if base in names and (not self.zones or member in self.zones or "facade" in member):
                total[member] = total.get(member, 0.0) + told["value"]
        true = self.numbers[key]
        each = true if isinstance(true, Mapping) else dict.fromkeys(total, true)
        ratios = [total[m] / here(each[m]) for m in total if m in each]
        return float(np.mean(ratios)) if ratios else None


def gap_of(answer: Mapping[str, Any]) -> float:
    """Held-out error of the calibrated baseline in the last third of a trial, whichever days were held out later [K].

    Parameters
    ----------
    answer : mapping
        Contents of ``diagnosis.json``.
    """
    elsewhere = answer.get("intervals", {}).get("mae_of_last_third")
    return float(answer["gap"]["mae"] if elsewhere is None else elsewhere)


def trial_of(name: str, label: Mapping[str, Any], answer: Mapping[str, Any], twins: Sequence[float]) -> Trial:
    """Put a label and an answer together.

    Parameters
    ----------
    name : str
        Of the trial.
    label : mapping
        Sealed label.
    answer : mapping
        Contents of ``diagnosis.json``.
    twins : sequence of float
        Held-out error on the twin without each of the effects [K].
    """
    effects = label["effects"]
    return Trial(
        name,
        label["kind"],
        tuple(frozenset(e["answers"]) for e in effects),
        tuple(e["name"] for e in effects),
        float(effects[0]["strength"]) if effects else 0.0,
        frozenset(effects[0]["zones"]) if effects else frozenset(),
        any(e["unexplained_is_right"] for e in effects),
        tuple(twins),
        answer,
        bool(label["stream"]),
        dict(effects[0].get("parameters", {})) if effects else {},
        label.get("world", "office"),
        label.get("building", ""),
    )


@dataclass(frozen=True)
class Rate:
    """A share of trials.

    Parameters
    ----------
    hits, of : int
        Trials that have it, and trials in all.
    """

    hits: int
    of: int

    @property
    def share(self) -> float:
        """The share [-]; NaN without trials."""
        return self.hits / self.of if self.of else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of it (Wilson 1927) [-]."""
        if not self.of:
            return float("nan"), float("nan")
        low, high = proportion_confint(self.hits, self.of, alpha=1.0 - _LEVEL, method="wilson")
        return float(low), float(high)

    def to_dict(self) -> dict[str, Any]:
        """Values for a file."""
        return {"hits": self.hits, "of": self.of, "share": self.share, "interval": list(self.interval)}


def _rate(hits: Iterable[bool]) -> Rate:
    """Count trials."""
    seen = [bool(h) for h in hits]
    return Rate(sum(seen), len(seen))


def score(trials: Sequence[Trial]) -> dict[str, Any]:
    """Score trials.

    Parameters
    ----------
    trials : sequence of Trial
        With their answers.

    Returns
    -------
    dict
        ``rates`` by name, ``strength`` (quartiles of found over true), ``closed`` (median share of the gap),
        ``by_effect``, ``by_strength``, ``reliability`` rows, ``uncounted`` (trials whose effects leave no gap, by
        verdict).
    """
    nulls = [t for t in trials if t.kind == "null"]
    singles = [t for t in trials if t.kind == "single" and t.counted]
    pairs = [t for t in trials if t.kind == "pair" and t.counted]
    outside = [t for t in trials if t.kind == "outside" and t.counted]
    inside = [*singles, *pairs]
    hidden = [t for t in trials if not t.counted]
    rates = {
        "nulls named": _rate(t.named for t in nulls),
        "nulls unexplained": _rate(t.answer["verdict"] == "unexplained" for t in nulls),
        "right first": _rate(t.right_first for t in singles),
        "right group": _rate(t.right_group for t in singles),
        "right in the first three": _rate(t.holds(t.ranked(3)) for t in singles),
        "named right": _rate(t.named and t.right_group for t in singles),
        "abstained": _rate(not t.named for t in singles),
        "wrong name, of all trials": _rate(t.wrong_name for t in trials),
        "a wrong one beside a right name": _rate(t.further_wrong for t in inside if t.named and t.right_first),
        "outside called unexplained": _rate(_outside_right(t) for t in outside),
        "both of a pair in the first two": _rate(_both(t) for t in pairs if len(t.shown) > 1),
        "one of a pair first": _rate(t.right_first for t in pairs),
        "90 % set covers": _rate(t.covered for t in inside if t.named),
        "right zones": _rate(_zones(t) for t in singles if t.named and t.right_first and t.zones),
    }
    closed = [t.answer["how_far"][-1]["share_closed"] for t in inside if t.named and t.answer["how_far"]]
    known = [c for c in closed if c is not None]
    effects = sorted({label for t in singles for label in t.labels})
    strengths = [t.strength_found for t in singles if t.named and t.right_first]
    ratios = [s for s in strengths if s is not None]
    return {
        "rates": rates,
        "strength": np.quantile(ratios, [0.25, 0.5, 0.75]).tolist() if ratios else [],
        "closed": float(np.median(known)) if known else float("nan"),
        "set_size": float(np.mean([float(len(t.answer["set90"])) for t in inside if t.named] or [np.nan])),
        "by_effect": {e: _row([t for t in singles if e in t.labels]) for e in effects},
        "by_strength": {
            f"{low:g} to {high:g}": _row([t for t in singles if low <= t.strength < high + 1e-9])
            for low, high in pairwise(_STRENGTHS)
        },
        "reliability": _reliability([*nulls, *inside]),
        "uncounted": {
            v: sum(t.answer["verdict"] == v for t in hidden) for v in ("no_gap", "named", "group", "unexplained")
        },
        "seconds": float(np.median([t.answer["seconds"] for t in trials])) if trials else float("nan"),
    }


def _outside_right(t: Trial) -> bool:
    return t.answer["verdict"] == "unexplained" or (t.named and t.right_group)


def _both(t: Trial) -> bool:
    """Whether the first two are both there, each for an effect of its own."""
    first, second = ({k for k, truth in enumerate(t.truths) if e in truth} for e in t.ranked(2))
    return bool(first) and bool(second) and len(first | second) > 1


def _zones(t: Trial) -> bool:
    found = set(t.answer["which"][0]["zones"])
    return bool(found & t.zones) and len(found - t.zones) <= len(t.zones)


def _row(trials: Sequence[Trial]) -> dict[str, Any]:
    return {
        "trials": len(trials),
        "right first": _rate(t.right_first for t in trials).share,
        "right group": _rate(t.right_group for t in trials).share,
        "abstained": _rate(not t.named for t in trials).share,
        "wrong name": _rate(t.wrong_name for t in trials).share,
    }


def _reliability(trials: Sequence[Trial]) -> list[dict[str, float]]:
    """How often effects are there that were given a probability, by class of it."""
    stated = np.array([s["probability"] for t in trials for s in t.answer["which"] if s["testable"]])
    present = np.array([t.holds([s["effect"]]) for t in trials for s in t.answer["which"] if s["testable"]])
    rows = []
    for low, high in pairwise(_PROBABILITIES):
        mine = (stated >= low) & ((stated < high) | (high == 1.0))
        if mine.any():
            rows.append(
                {"from": low, "to": high, "stated": float(stated[mine].mean()), "present": float(present[mine].mean()),
                 "count": int(mine.sum())}
            )  # fmt: skip
    return rows
