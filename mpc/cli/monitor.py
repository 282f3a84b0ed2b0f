"""``buildingmpc monitor``: since when something has changed in a building, what, and when it was mended."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from mpc.cli import options
from mpc.cli.console import Waiting, answer, say, show_table

if TYPE_CHECKING:
    from calibration.monitoring.monitor import Monitoring


def monitor(
    case: options.CaseFolder,
    out: Annotated[Path, options.folder("monitoring.json, weekly.parquet, daily.parquet, report.html")],
    parameters: Annotated[
        Path | None, options.file("calibration.json of this case; default: fitted to the reference days.")
    ] = None,
    reference_days: Annotated[int, options.value("First days, which are taken for sound.")] = 42,
    effects: Annotated[
        str, options.value("Effects of the fit, without --parameters; default: sun, leakage, people.", "ID,...")
    ] = "",
    rule_out: Annotated[str, options.value("Effects that are known not to change.", "ID,...")] = "",
    horizon: options.Horizon = "6h",
    dx: options.Dx = None,
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Go through the telemetry of weeks to years, and say since when something has changed, what, and until when.

    Example: buildingmpc monitor cases/office --out watched
    """
    from calibration.monitoring.monitor import MonitorSettings
    from calibration.monitoring.monitor import monitor as watch
    from mpc.reports.monitoring import monitoring_summary, write_monitoring

    loaded = options.open_case(case, out, force)
    settings = MonitorSettings(
        reference_days, horizon, dx, options.ids(effects) or None, options.ids(rule_out)
    )
    with Waiting(f"monitor {case.name}") as progress:
        found = watch(loaded, parameters, settings, progress=progress)
        report = write_monitoring(found, out, force=force)
    return answer(json, monitoring_summary(found), lambda: _show(found), report)


def _show(found: Monitoring) -> None:
    from mpc.reports.monitoring import event_rows, monitoring_verdict

    say(monitoring_verdict(found))
    if found.events:
        columns = {"since": "", "until": "", "what": "", "where": "", "sure": "", "size": "", "noticed": ""}
        keys = ("since", "until", "what", "where", "sure", "size", "noticed")
        show_table("Changes", columns, [[row[key] for key in keys] for row in event_rows(found)])
