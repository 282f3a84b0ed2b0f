"""What an effect of the catalogue is, and how it joins a building's network."""

import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import casadi as ca

from thermal.errors import EffectError, nearest
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal
from thermal.network.graph import GraphBuilder
from thermal.network.structure import MAY_DIFFER
from thermal.network.topology import Anatomy, Emission, Room
from thermal.parameters import Parameter

#: Adds an effect to a graph, in some of its zones (all of them when there are none).
Builder = Callable[["EffectBuilder"], None]

#: Words and numbers of the catalogue, by id.
_TABLE = tomllib.loads(files(__package__).joinpath("catalogue.toml").read_text(encoding="utf-8"))

#: Between the names of two zones, where a strength belongs to both.
PAIR = " + "

#: In the place of an effect's zones: all of them, with one strength.
ALIKE = ("*",)


def zones_of(members: Iterable[str]) -> tuple[str, ...]:
    """Name the zones that strengths belong to, those of pairs one by one, each once.

    Parameters
    ----------
    members : iterable of str
        Zones and pairs of zones.

    Examples
    --------
    >>> zones_of(["hall + kitchen", "kitchen"])
    ('hall', 'kitchen')
    """
    return tuple(dict.fromkeys(zone for member in members for zone in member.split(PAIR)))


@dataclass(frozen=True)
class Effect:
    """An effect that a building may have and the baseline does not.

    Parameters
    ----------
    id : str
        Short name, fixed for good.
    title : str
        In plain words.
    equation : str
        Heat that it brings, with symbols as in the nomenclature.
    source : str
        Where equation and ranges come from.
    acts_on : str
        Control volumes that receive the heat.
    confounders : tuple of str
        What looks alike: ids of effects, or words.
    separated_by : str
        Experiment that tells it from these.
    parameters : tuple of Parameter
        What it brings; the first is its strength, 0 where it is absent.
    build : callable
        Adds its terms.
    needs : tuple of str
        Point types of the weather station that it cannot do without.
    zonal : bool
        Whether it may be there in some zones only; it then has a strength a zone.
    courses : bool
        Whether it is heat of its own in each zone that is named, or a course of its own where all are; without zones it
        follows a schedule everywhere.
    alike : bool
        Whether one cause may give all zones one strength, such as cold water; valves leak one by one. A factor of all
        meters is a scale of all masses and conductances, which nothing but a known heater tells, and is not sought.
    requires : tuple of str
        Effects that it modifies, and without which it means nothing.
    applies : callable, optional
        Says why a building cannot have it, None when it can; every building can by default.
    shifts : tuple of str
        Parameters by which it moves telemetry in time [h]. Up to a step they say how a value is spread over its own
        step, which telemetry cannot tell from the effect.
    roughly : bool
        Whether a rough estimate of what it needs is enough to tell that it is there.
    level : str
        Parameter that the effect's heat per unit of strength is linear in, so that what it is matters as much as the
        strength; empty where there is none.
    keywords : tuple of str
        Words that people look for it by, beside those of its id and title.
    """

    id: str
    title: str
    equation: str
    source: str
    acts_on: str
    confounders: tuple[str, ...]
    separated_by: str
    parameters: tuple[Parameter, ...]
    build: Builder
    needs: tuple[str, ...] = ()
    zonal: bool = False
    courses: bool = False
    alike: bool = False
    requires: tuple[str, ...] = ()
    applies: Callable[[Anatomy], str | None] | None = None
    shifts: tuple[str, ...] = ()
    level: str = ""
    roughly: bool = False
    keywords: tuple[str, ...] = ()

    @property
    def takes_zones(self) -> bool:
        """Whether zones may be named for it."""
        return self.zonal or self.courses

    def is_meant_by(self, words: Sequence[str], begun: bool = False) -> bool:
        """Tell whether words may mean this effect: any of them is one of its own.

        Parameters
        ----------
        words : sequence of str
            In small letters.
        begun : bool
            Whether the first four letters or more of one of its words will do.
        """
        own = {*f"{self.id.replace('_', ' ')} {self.title}".casefold().split(), *self.keywords}
        return any(w == o or (begun and len(w) > 3 and o.startswith(w)) for w in words for o in own)

    def untestable(self, inputs: InputProvider, anatomy: Anatomy) -> str | None:
        """Say why a case cannot tell whether the effect is there; None when it can.

        Parameters
        ----------
        inputs : InputProvider
            Of the case's telemetry.
        anatomy : Anatomy
            Of its building.
        """
        missing = [p for p in self.needs if not (inputs.measured(p) or (self.roughly and inputs.estimates(p)))]
        if missing:
            return f"not measured: {', '.join(missing)}"
        return None if self.applies is None else self.applies(anatomy)


@dataclass(frozen=True)
class Chosen:
    """An effect in some zones of a building: what a network is extended by.

    Parameters
    ----------
    effect : Effect
        Which.
    zones : tuple of str
        Where, with a strength each; all zones when empty. All of them with one strength: `ALIKE`.
    """

    effect: Effect
    zones: tuple[str, ...] = ()

    def extend(self, graph: GraphBuilder) -> None:
        """Add volumes, faces, sources and parameters to a graph whose baseline is complete.

        Parameters
        ----------
        graph : GraphBuilder
            With its anatomy.

        Raises
        ------
        EffectError
            When a zone is not of the building, or the effect cannot be in some zones only.
        """
        alike = self.zones == ALIKE
        unknown = [] if alike else sorted(set(self.zones) - set(graph.zones))
        if unknown:
            known = nearest(unknown[0], graph.zones)
            raise EffectError(f"effect {self.effect.id}: zones {unknown} are not of this building; {known}")
        if self.zones and not self.effect.takes_zones:
            found = f"zones {list(self.zones)}; leave them out"
            raise EffectError(f"effect {self.effect.id}: acts on the whole building, got {found}")
        zones = graph.zones if alike or not self.zones else self.zones
        self.effect.build(EffectBuilder(graph, self.effect, zones, alike, bool(self.zones)))


class EffectBuilder:
    """What an effect adds its terms to a graph with.

    Parameters
    ----------
    graph : GraphBuilder
        The building.
    effect : Effect
        What is added.
    zones : tuple of str
        Where it may act.
    alike : bool
        Whether zones share what is a zone's otherwise.
    named : bool
        Whether somebody named the zones.
    """

    def __init__(
        self, graph: GraphBuilder, effect: Effect, zones: Sequence[str], alike: bool = False, named: bool = False
    ) -> None:
        self.graph, self.effect, self.anatomy, self._alike = graph, effect, graph.anatomy, alike
        self.named = named
        self.rooms: tuple[Room, ...] = tuple(graph.anatomy.rooms[z] for z in zones)
        self._count = 0
        self._keys: dict[int, tuple[str, ca.SX]] = {}

    def parameter(self, name: str, zone: str | None = None, facade: str | None = None) -> ca.SX:
        """Symbol of one of the effect's parameters, or that of a zone or a facade.

        Parameters
        ----------
        name : str
            Its name.
        zone, facade : str, optional
            Whose value it is.

        Raises
        ------
        EffectError
            When the effect has none of this name.
        """
        own = {p.name: p for p in self.effect.parameters}
        if name not in own:
            raise EffectError(f"effect {self.effect.id}: has no parameter {name!r}; {nearest(name, own)}")
        found = own[name]
        if zone is not None and not self._alike:
            found = found.of("zone", zone)
        elif facade is not None:
            found = found.of("facade", facade)
        return self.graph.own(found)

    def share(self, room: str, effect: Effect | None = None) -> ca.SX | float:
        """Share that a room has of an effect of the whole building, 1 where rooms do not differ in it.

        Parameters
        ----------
        room : str
            Its name.
        effect : Effect, optional
            The one that this one modifies; this one by default.
        """
        of = effect or self.effect
        if of.id not in self.graph.structure.uneven:
            return 1.0
        own = next(p for p in of.parameters if p.name == MAY_DIFFER[of.id])
        return self.graph.own(own.of("zone", room))

    def key(self, what: str = "") -> str:
        """Name of a new class of this effect.

        Parameters
        ----------
        what : str
            Where, for those who read it.
        """
        self._count += 1
        return f"{self.effect.id} {what} {self._count}".replace("  ", " ")

    def heat_air(self, room: Room, value: ca.SX, signal: Signal, weight: float) -> None:
        """Give heat to a zone's air, ``value weight s`` [W].

        Parameters
        ----------
        room : Room
            The zone.
        value : casadi.SX
            Heat per unit of weight and signal [W per both].
        signal : Signal
            What drives it.
        weight : float
            Geometry, such as an area [m2].
        """
        self.graph.source(self._shared(value), value, room.air, signal, weight * room.share)

    def heat_like_meter(
        self, room: Room, value: ca.SX, signal: Signal, moved: Callable[[Emission], Signal], weight: float = 1.0
    ) -> None:
        """Give a zone heat, ``value weight s`` [W], where its devices give theirs.

        Parameters
        ----------
        room : Room
            The zone.
        value : casadi.SX
            Heat per unit of weight and signal [W per both].
        signal : Signal
            What drives it.
        moved : callable
            What drives the part of the heat that emitters do not give to the air.
        weight : float
            What it is multiplied by [-].
        """
        self.heat_air(room, value, signal, weight)
        for emission in room.emitted:
            for share, node, part in emission.parts:
                self.graph.source(self.key(room.name), value * share, node, moved(emission), weight * part)

    def heat_surfaces(self, room: Room, value: ca.SX, signal: Signal, weight: float) -> None:
        """Give heat to a zone's surfaces by its radiant node; to its air where it has none.

        Parameters
        ----------
        room : Room
            The zone.
        value : casadi.SX
            Heat per unit of weight and signal [W per both].
        signal : Signal
            What drives it.
        weight : float
            Geometry, such as an area [m2].
        """
        if room.radiant < 0:
            self.heat_air(room, value, signal, weight)
        else:
            self.graph.source(self._shared(value), value, room.radiant, signal, weight)

    def air_to(self, room: Room, value: ca.SX, far: int, weight: float) -> None:
        """Join a zone's air to a node or a boundary, ``value weight`` [W/K].

        Parameters
        ----------
        room : Room
            The zone.
        value : casadi.SX
            Conductance per unit of weight [W/K per weight].
        far : int
            Node, or code of a boundary.
        weight : float
            Geometry, such as an area [m2].
        """
        self.graph.face(self._shared(value), value, room.air, far, weight * room.share)

    def _shared(self, value: ca.SX) -> str:
        """Class of all faces of one kind with this very value: many classes make a large building slow."""
        number = value.element_hash()
        if number not in self._keys:
            self._keys[number] = (self.key(), value)  # the value is kept, or another might get its number
        return self._keys[number][0]


def strength(name: str, unit: str, upper: float, source: str, effect: str, lower: float = 0.0) -> Parameter:
    """Parameter of an effect that is absent at 0.

    Parameters
    ----------
    name, unit, source, effect : str
        As in `Parameter`.
    upper, lower : float
        Plausible range [unit].
    """
    return Parameter(name, unit, 0.0, lower, upper, source, "linear", effect)


def described(name: str, build: Builder, applies: Callable[[Anatomy], str | None] | None = None) -> Effect:
    """Make an effect of the catalogue from its entry in ``catalogue.toml``.

    Parameters
    ----------
    name : str
        Its id.
    build, applies : callable
        As in `Effect`.
    """
    entry: dict[str, Any] = _TABLE[name]
    parameters = tuple(
        Parameter(**{"start": 0.0, "scale": "linear", "effect": name} | row) for row in entry["parameters"]
    )
    rest: Any = {key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()}
    return Effect(**rest | {"id": name, "parameters": parameters, "build": build, "applies": applies})


def lacking(part: str, reason: str) -> Callable[[Anatomy], str | None]:
    """Make what says that a building has nothing of which an effect is made, for `Effect.applies`.

    Parameters
    ----------
    part : str
        Attribute of `Anatomy`.
    reason : str
        What is said where it is empty.
    """
    return lambda anatomy: None if getattr(anatomy, part) else reason


#: Says that a building has no exterior walls.
without_facades = lacking("facades", "the building has no exterior walls")
