"""The catalogue in words: the table of the documentation, made from what the model has."""

from __future__ import annotations

from collections.abc import Iterable

from thermal.effects.effect import Effect
from thermal.parameters import Parameter

_HEAD = ("id", "what, and its heat", "acts on", "parameters", "needs", "looks like", "told apart by", "source")


def catalogue_table(effects: Iterable[Effect]) -> str:
    """Write effects as a Markdown table, one row each.

    Parameters
    ----------
    effects : iterable of Effect
        Such as the values of the catalogue.

    Examples
    --------
    >>> from thermal.effects.catalogue import CATALOGUE
    >>> print(catalogue_table([CATALOGUE["latent_load"]]).splitlines()[2][:70])
    | `latent_load` | heat that evaporating water takes: -L A occ(t) | air
    """
    rows = [_HEAD, tuple("-" * 3 for _ in _HEAD), *(_cells(e) for e in effects)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _cells(effect: Effect) -> tuple[str, ...]:
    needs = ", ".join(f"`{n}`" for n in (*effect.needs, *effect.requires)) or "no signal of its own"
    alike = ", ".join(name if " " in name else f"`{name}`" for name in effect.confounders)
    cells = (
        f"`{effect.id}`",
        f"{effect.title}: {effect.equation}",
        effect.acts_on + ("; a strength a zone" if effect.zonal else ""),
        "<br>".join(_range(p) for p in effect.parameters),
        needs,
        alike,
        effect.separated_by,
        effect.source,
    )
    return tuple(cell.replace("|", "\\|") for cell in cells)


def _range(parameter: Parameter) -> str:
    start = "" if parameter.start == 0.0 else f", from {parameter.start:g}"
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"`{parameter.name}` {parameter.lower:g} to {parameter.upper:g}{unit}{start}"
