"""The table of controllers that ran side by side, for pages and terminals."""

from mpc.reports.page import spell
from mpc.studies.run import Comparison


def comparison_table(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the table of controllers, without columns that nothing stands in.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    """
    heads, rows = comparison_columns(comparison.study.scenario.currency), comparison_rows(comparison)
    kept = [k for k in range(len(heads)) if any(row[k] != spell(None) for row in rows)]
    return [heads[k] for k in kept], [[row[k] for k in kept] for row in rows]


def comparison_columns(currency: str) -> list[str]:
    """Heads of the table of controllers.

    Parameters
    ----------
    currency : str
        Of costs.
    """
    return [
        "controller", f"energy cost [{currency}]", f"energy cost and price of discomfort [{currency}]",
        "saved against the best rule, discomfort counted", "discomfort, mean zone [K h]",
        "discomfort, worst zone [K h]", "energy [kWh/m²]", "highest quarter of an hour of electricity [W/m²]",
        "emissions of CO₂ [g/m²]", "share of the perfect-forecast savings",
    ]  # fmt: skip


def comparison_rows(comparison: Comparison) -> list[list[str]]:
    """Rows of the table of controllers, from cost to the share of the perfect-forecast savings.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_controllers`.
    """
    rows = []
    for run in comparison.runs:
        k, best = run.kpis, run is comparison.best_rule
        worst = max(z.below + z.above for z in k.zones)
        way = comparison.way_to_bound(run) if run.controller in ("mpc", "bound") else None
        values = (
            (run.cost, ",.2f"), (run.objective, ",.2f"), (None if best else comparison.saving(run), "percent"),
            (k.tdis_tot, ".3f"), (worst, ".2f"), (k.ener_tot, ".3f"), (1e3 * (k.pele_tot or 0.0), ".1f"),
            (None if k.emis_tot is None else 1e3 * k.emis_tot, ".1f"), (way, "percent"),
        )  # fmt: skip
        rows.append([run.entry.title, *(spell(value, how) for value, how in values)])
    return rows
