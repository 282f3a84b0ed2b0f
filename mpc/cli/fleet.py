"""A folder of cases for ``buildingmpc calibrate`` and ``diagnose``: each into a folder of its name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from calibration.errors import CalibrationError
from mpc import plugins
from mpc.cli import options
from mpc.cli.console import Waiting, answer, complain, show_table

if TYPE_CHECKING:
    from calibration.fleet.case import CaseOutcome
    from calibration.fleet.job import Files

_BUILDING = "building.yaml"

Workers = Annotated[int | None, options.value("Processes that share a folder of cases; default: one a core.")]
Scheduler = Annotated[
    str | None, options.value("Of a dask cluster for a folder of cases, such as tcp://10.0.0.1:8786.", "ADDRESS")
]


def cases_in(folder: Path, out: Path, workers: int | None, scheduler: str | None) -> Sequence[Path]:
    """Find the cases in a folder of cases; none where it is a case itself.

    Parameters
    ----------
    folder, out : Path
        Case folder or folder of cases, and folder of the results.
    workers : int, optional
        Processes.
    scheduler : str, optional
        Of a cluster.

    Raises
    ------
    CalibrationError
        When workers are given for one case, or workers and a cluster.
    """
    from calibration.fleet.run import case_folders

    if workers is not None and scheduler is not None:
        raise CalibrationError("--workers and --scheduler: expected one of them; a cluster has workers of its own")
    if (folder / _BUILDING).exists() or not (cases := case_folders(folder)):
        if workers is not None or scheduler is not None:
            raise CalibrationError(
                f"{folder}: --workers and --scheduler are for a folder of cases, one folder each; expected {_BUILDING} "
                "in some of its folders, and not beside them"
            )
        return ()
    inside = [p for p in sorted(folder.iterdir()) if p.is_dir() and p.name[0] != "."]
    others = [p.name for p in inside if p not in cases and p != out]
    if others:
        complain(f"left out, for want of {_BUILDING}: {', '.join(others)}")
    return cases


def many(
    what: Literal["calibrate", "diagnose"], cases: Sequence[Path], out: Path, settings: dict[str, Any],
    workers: int | None, scheduler: str | None, force: bool, json: bool,
) -> int:  # fmt: skip
    """Calibrate or diagnose each case into a folder of its name; one that fails is reported beside the others.

    Parameters
    ----------
    what : {"calibrate", "diagnose"}
        What to do.
    cases : sequence of Path
        Case folders.
    out : Path
        Folder of the results.
    settings : mapping of str to Any
        Of each calibration or diagnosis.
    workers : int, optional
        Processes.
    scheduler : str, optional
        Of a cluster.
    force, json : bool
        As the options of the commands.

    Returns
    -------
    int
        Exit code.
    """
    from calibration.fleet.cluster import ClusterExecutor
    from mpc.reports.display import Displayed, display
    from thermal.case.validation import NO_WINDOWS

    do: Callable[..., Sequence[CaseOutcome]]
    files: Files
    if what == "calibrate":
        from calibration.fleet.run import calibrate_many
        from mpc.reports.calibration import calibration_files

        do, files = calibrate_many, calibration_files
    else:
        from calibration.fleet.diagnose import diagnose_many
        from mpc.reports.diagnosis import diagnosis_files

        do, files = diagnose_many, diagnosis_files
    from mpc.reports.fleet import write_fleet

    cluster = nullcontext() if scheduler is None else ClusterExecutor(scheduler, folders=[cases[0].parent])
    try:
        with Waiting(f"{what} cases") as waiting, cluster as executor:
            outcomes = do(
                cases, out, settings, files=plugins.WithPlugins(Displayed(files, display()), plugins.loaded),
                workers=executor or workers, force=force,
                progress=lambda _, done, total: waiting(f"{done} of {total}", done, total),
            )  # fmt: skip
    except KeyboardInterrupt:
        complain(f"interrupted: what is finished is in {out}, and the same command goes on from there")
        raise
    for outcome in outcomes:
        if outcome.error is not None:
            complain(f"error: {outcome.case}: {outcome.error}: {outcome.message}")
        elif outcome.solver is not None and outcome.status == "not_converged":
            name, status = outcome.solver["name"], outcome.solver["status"]
            complain(f"error: {outcome.case}: {name} did not converge: {status}; the results say so too")
    if blind := [outcome.case for outcome in outcomes if outcome.has_windows is False]:
        has = "has" if len(blind) == 1 else "have"
        told = NO_WINDOWS.replace("the building has", f"{len(blind)} of {len(outcomes)} buildings {has}", 1)
        complain(f"warning: {', '.join(blind)}: {told}")
    content = {"cases": {outcome.case: outcome.to_dict() for outcome in outcomes}}
    report = write_fleet(outcomes, out, what, settings["horizon"])
    answer(json, content, lambda: _show_outcomes(what, outcomes, settings["horizon"]), report)
    if all(outcome.status in ("calibrated", "diagnosed") for outcome in outcomes):
        return 0
    return 2 if all(outcome.bad_input for outcome in outcomes) else 1


def _show_outcomes(what: str, outcomes: Sequence[CaseOutcome], horizon: str) -> None:
    rows: list[tuple[Any, ...]] = []
    for o in outcomes:
        remarks = (", done before" if o.resumed else "") + (", no windows" if o.has_windows is False else "")
        status = o.error or o.status.replace("_", " ") + remarks
        found = () if what == "calibrate" else ((o.verdict or "").replace("_", " "), ", ".join(o.effects))
        rows.append((o.case, o.held_out_mae_before, o.held_out_mae_after, *found, o.seconds, status))
    errors = {"before [K]": ".3f", "after [K]": ".3f"}
    columns = {"case": "", **errors, "time [s]": ".1f", "status": ""}
    if what == "diagnose":
        errors = {"calibrated [K]": ".3f", "handed on [K]": ".3f"}
        columns = {"case": "", **errors, "verdict": "", "effects": "", "time [s]": ".1f", "status": ""}
    show_table(f"Held-out error {horizon} ahead", columns, rows, more="summary.json lists them all")
    if what == "diagnose":
        named = Counter(effect for o in outcomes if o.verdict in ("named", "group") for effect in o.effects)
        show_table("Found", {"effect": "", "cases": ".0f"}, named.most_common())
