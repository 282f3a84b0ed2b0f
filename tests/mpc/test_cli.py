"""The subcommands: what they print, what they write, and with which code they leave."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from mpc.cli.app import app, main
from thermal.data import bundled_case_path

CASE = str(bundled_case_path())
EPILOGS = (
    *("check", "simulate", "evaluate", "calibrate", "diagnose", "demo", "doctor", "import-plan", "import-devices"),
    *("control", "compare", "serve", "label", "import-telemetry", "effects", "experiment", "monitor", "identify"),
    *("discover", "verify", "priors", "operate", "rehearse", "replay"),
)


def run(*arguments: str | Path) -> Any:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def calibrated(coarse_case: Path, blank_pictures: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cli") / "results"
    answer = run("calibrate", coarse_case, "--out", out, "--dx", "1.0", "--json")
    assert answer.exit_code == 0, answer.stderr
    assert json.loads(answer.stdout) == json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    return out


@pytest.fixture
def spoilt(tmp_path: Path) -> Path:
    folder = tmp_path / "spoilt"
    shutil.copytree(CASE, folder)
    text = (folder / "building.yaml").read_text(encoding="utf-8")
    (folder / "building.yaml").write_text(text.replace("zone: F1_N", "zone: F1_X"), encoding="utf-8")
    return folder


@pytest.mark.parametrize("command", EPILOGS)
def test_help_has_an_example(command: str) -> None:
    answer = run(command, "--help")
    assert answer.exit_code == 0
    assert f"Example: buildingmpc {command}" in " ".join(answer.stdout.split())


def test_help_keeps_units_in_brackets() -> None:
    shown = (" ".join(run(command, "--help").stdout.split()) for command in ("verify", "experiment"))
    assert ['--power "main [kW]"' in next(shown), "Longest length [h]." in next(shown)] == [True, True]


def test_only_what_exists_is_offered() -> None:
    answer = run("--help")
    assert answer.exit_code == 0
    assert sorted(c.name or c.callback.__name__.replace("_", "-") for c in app.registered_commands) == sorted(EPILOGS)


def test_version() -> None:
    assert run("--version").stdout.startswith("buildingmpc ")


def test_check_prints_what_is_there() -> None:
    answer = run("check", CASE)
    assert (answer.exit_code, answer.stderr) == (0, "")
    for text in ("The case is valid", "F1_N", "102.2", "zone_air_temperature_sensor", "degC", "wind speed"):
        assert text in answer.stdout


def test_check_writes_and_answers_in_json(tmp_path: Path) -> None:
    answer = run("check", CASE, "--out", tmp_path / "check", "--json")
    assert (answer.exit_code, answer.stderr) == (0, "")
    assert json.loads(answer.stdout) == json.loads((tmp_path / "check" / "check.json").read_text(encoding="utf-8"))
    assert (tmp_path / "check" / "report.html").is_file()


def test_bad_input_is_named_on_stderr(spoilt: Path) -> None:
    answer = run("check", spoilt, "--json")
    assert answer.exit_code == 2 and json.loads(answer.stdout)["error"]["name"] == "CaseError"
    assert run("check", spoilt).stdout == ""
    assert answer.stderr.startswith("error: CaseError: ")
    assert "nearest valid one is 'F1_W'" in answer.stderr and "Traceback" not in answer.stderr


def test_debug_shows_the_traceback(spoilt: Path) -> None:
    answer = run("--debug", "check", spoilt)
    assert answer.exit_code == 2
    assert "Traceback" in answer.stderr and "error: CaseError" in answer.stderr
    assert "Traceback" not in run("check", spoilt).stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("check", "nowhere"), "CaseError"),
        (("check",), "Missing argument"),
        (("check", CASE, "--jsn"), "No such option"),
        (("evaluate", CASE, "--horizon", "7min"), "HorizonError"),
        (("evaluate", CASE, "--interval", "2023-03-05"), "CalibrationError"),
        (("evaluate", CASE, "--scheme", "euler"), "CalibrationError: scheme: expected one of implicit_euler, tr_bdf2"),
        (("evaluate", CASE, "--parameters", f"{CASE}/building.yaml"), "CalibrationError"),
        (("evaluate", CASE, "--dx", "0.3"), "ModelError"),
        (("simulate", CASE, "--start", "soon", "--end", "2023-03-05"), "CaseError"),
        (("simulate", CASE, "--start", "2023-03-01T01:00", "--end", "2023-03-02"), "ModelError"),
        (("calibrate", CASE), "Missing option"),
        (("calibrate", CASE, "--out", "unused", "--starts", "0"), "CalibrationError: starts"),
        (("calibrate", CASE, "--out", "unused", "--objective", "kalman"), "CalibrationError: objective"),
        (("calibrate", CASE, "--out", "unused", "--tune", "2023-03-01/2023-03-11"), "CalibrationError: intervals"),
        (("calibrate", "nowhere", "--out", "unused"), "CaseError"),
    ],
)
def test_bad_requests(
    arguments: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = run(*arguments)
    assert (answer.exit_code, answer.stdout) == (2, "")
    assert message in answer.stderr and "Traceback" not in answer.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_unexpected_error_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(path: object) -> None:
        raise ZeroDivisionError("of no one's making")

    monkeypatch.setattr("thermal.case.check.check_case", broken)
    answer = run("check", CASE)
    assert (answer.exit_code, answer.stdout) == (1, "")
    assert answer.stderr == (
        "error: ZeroDivisionError: of no one's making\nFor the place in the code: buildingmpc --debug check ...\n"
    )


@pytest.mark.parametrize(
    ("words", "name", "told"),
    [
        (("check", "/nowhere"), "CaseError", "expected a case folder, found nothing"),
        (("check", CASE, "--spam"), "UsageError", "No such option: --spam"),
        ((), "UsageError", "Missing command."),
        (("check", "/nowhere (a=b)"), "CaseError", "/nowhere (a=b)"),
        (("chek",), "UsageError", "No such command 'chek'. Did you mean 'check'?"),
        (("evaluate", CASE, "--out", "/proc/results"), "CalibrationError", "expected a place that can be written to"),
    ],
)
def test_with_json_an_error_is_json(words: tuple[Any, ...], name: str, told: str, capsys, monkeypatch) -> None:
    monkeypatch.setattr("sys.argv", ["buildingmpc", *map(str, words), "--json"])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    error = json.loads(out)["error"]
    assert (error["name"], error["exit_code"], ended.value.code) == (name, 2, 2) and told in error["message"]
    assert "Traceback" not in err and told in err


def test_with_json_an_interruption_is_json(capsys, monkeypatch) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("mpc.cli.app.load_plugins", stopped)
    monkeypatch.setattr("sys.argv", ["buildingmpc", "check", str(CASE), "--json"])
    with pytest.raises(SystemExit) as ended:
        main()
    error = json.loads(capsys.readouterr().out)["error"]
    assert (error["name"], error["exit_code"], ended.value.code) == ("Interrupted", 130, 130)


def test_the_version_as_text_and_as_json() -> None:
    from importlib.metadata import version

    assert run("--version").stdout == f"buildingmpc {version('buildingmpc')}\n"
    for words in (("--version", "--json"), ("--json", "--version")):
        assert json.loads(run(*words).stdout) == {"name": "buildingmpc", "version": version("buildingmpc")}


def test_a_command_is_not_told_of_python(tmp_path: Path) -> None:
    (tmp_path / "old").write_text("")
    answer = run("calibrate", CASE, "--out", tmp_path)
    assert answer.exit_code == 2 and answer.stderr.rstrip().endswith("found old; choose another, or --force")


def test_an_effect_is_found_by_what_it_means(tmp_path: Path) -> None:
    answer = run("calibrate", CASE, "--out", tmp_path / "out", "--effects", "sun")
    assert answer.exit_code == 2 and "it may be solar_gain (sun through the windows)" in answer.stderr


def test_a_building_without_windows_is_said_loudly_before_it_is_calibrated(tmp_path: Path, capsys: Any) -> None:
    from mpc.cli.options import open_case

    folder = tmp_path / "dark"
    shutil.copytree(CASE, folder)
    content = yaml.safe_load((folder / "building.yaml").read_text(encoding="utf-8"))
    assert open_case(folder, None, False) and capsys.readouterr().err == ""
    (folder / "building.yaml").write_text(yaml.safe_dump(content | {"glazing": {}}), encoding="utf-8")
    open_case(folder, None, False)
    told = capsys.readouterr().err
    assert told.startswith("warning: the building has no windows") and f"buildingmpc label {folder}" in told
    answer = run("check", folder)
    assert answer.exit_code == 0 and "the building has no windows" in answer.stdout


def test_what_a_base_install_lacks_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    from mpc.cli import doctor

    there = doctor._installed_packages()
    gone = [p | ({"fine": False} if p["extra"] == "plan" else {}) for p in there]
    monkeypatch.setattr(doctor, "_installed_packages", lambda: gone)
    assert doctor.missing_extras("pages", "plan") == 'pip install "buildingmpc[pages,plan]"'
    monkeypatch.setattr(doctor, "_installed_packages", lambda: [p | {"fine": True} for p in there])
    assert doctor.missing_extras("pages", "plan") == ""


def test_results_are_kept_unless_forced(coarse_case: Path, calibrated: Path) -> None:
    answer = run("calibrate", coarse_case, "--out", calibrated, "--dx", "1.0")
    assert answer.exit_code == 2
    assert "ResultsExistError" in answer.stderr and "--force" in answer.stderr
    answer = run("check", CASE, "--out", calibrated / "calibration.json")
    assert answer.exit_code == 2 and "found a file" in answer.stderr


def test_evaluate_takes_the_grid_of_the_parameters(coarse_case: Path, calibrated: Path, tmp_path: Path) -> None:
    out = tmp_path / "errors"
    answer = run("evaluate", coarse_case, "--parameters", calibrated / "calibration.json",
                 "--interval", "2023-03-07T16:30/2023-03-11", "--json", "--out", out)  # fmt: skip
    assert (answer.exit_code, answer.stderr) == (0, "")
    found = json.loads(answer.stdout)
    assert found == json.loads((out / "evaluation.json").read_text(encoding="utf-8"))
    wanted = json.loads((calibrated / "evaluation.json").read_text(encoding="utf-8"))
    assert found["mae"] == pytest.approx(wanted["mae"], abs=1e-3)
    assert list(found["by_horizon"]) == ["1h", "3h", "6h", "24h"]
    assert sorted(p.name for p in out.iterdir()) == ["evaluation.json", "predictions.parquet", "report.html"]


def test_evaluate_without_parameters_is_uncalibrated(coarse_case: Path, calibrated: Path) -> None:
    answer = run("evaluate", coarse_case, "--dx", "1.0", "--interval", "2023-03-07T16:30/2023-03-11")
    assert answer.exit_code == 0
    assert "uncalibrated start values" in answer.stdout and "F1_S" in answer.stdout
    before = json.loads((calibrated / "calibration.json").read_text(encoding="utf-8"))["uncalibrated"]["held_out"]
    assert f"{before['mae']:.3f}" in answer.stdout


def test_simulate(coarse_case: Path, calibrated: Path, tmp_path: Path) -> None:
    arguments = ("simulate", coarse_case, "--start", "2023-03-05", "--end", "2023-03-06T12:00", "--out", tmp_path / "replay")
    answer = run(*arguments, "--parameters", calibrated / "calibration.json")
    assert (answer.exit_code, answer.stderr) == (0, "")
    assert "F1_W" in answer.stdout and "report.html" in answer.stdout
    content = json.loads((tmp_path / "replay" / "simulation.json").read_text(encoding="utf-8"))
    assert (content["steps"], content["step_seconds"]) == (72, 1800.0)
    assert content["start"] == "2023-03-05T00:00:00-05:00" and 0.0 < content["mae"] < 2.0
    assert set(content["by_zone"]) == {"F1_N", "F1_W", "F1_C", "F1_E", "F1_S"}


@pytest.mark.long
def test_a_folder_of_cases_reports_each(coarse_case: Path, blank_pictures: None, spoilt: Path, tmp_path: Path) -> None:
    shutil.copytree(coarse_case, spoilt.parent / "whole")
    out = tmp_path / "out"
    answer = run("calibrate", spoilt.parent, "--out", out, "--dx", "2.0", "--starts", "1", "--json")
    assert answer.exit_code == 1
    cases = json.loads(answer.stdout)["cases"]
    assert cases["spoilt"]["error"] == "CaseError"
    assert cases["whole"]["solver"]["success"] is True
    assert "error: spoilt: CaseError" in answer.stderr
    assert sorted(p.name for p in out.iterdir()) == ["fleet.parquet", "report.html", "summary.json", "tables", "whole"]
    assert (out / "whole" / "report.html").is_file()
    shutil.rmtree(spoilt.parent / "whole")
    answer = run("calibrate", spoilt.parent, "--out", tmp_path / "none")
    assert answer.exit_code == 2 and "CaseError" in answer.stdout


def test_a_solver_that_does_not_converge_is_a_failure_with_results(
    coarse_case: Path, blank_pictures: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    import calibration.fit.calibrate as calibration

    fit = calibration.calibrate

    def stopped(*args: Any, **settings: Any) -> Any:
        result = fit(*args, **settings)
        return replace(result, solver=replace(result.solver, success=False, status="Maximum_Iterations_Exceeded"))

    monkeypatch.setattr(calibration, "calibrate", stopped)
    answer = run("calibrate", coarse_case, "--out", tmp_path / "results", "--dx", "2.0", "--structure", "drawn", "--starts", "1")
    assert answer.exit_code == 1
    assert "did not converge: Maximum_Iterations_Exceeded" in answer.stderr
    assert "do not rely on these numbers" in answer.stdout
    assert (tmp_path / "results" / "calibration.json").is_file()


def test_doctor() -> None:
    answer = run("doctor", "--json")
    content = json.loads(answer.stdout)
    assert content["fine"] is True and answer.exit_code == 0
    assert content["tests"]["ipopt"]["fine"] and content["tests"]["splu"]["fine"]
    assert content["extras"]["energyplus"]["install"] == 'pip install "buildingmpc[energyplus]"'
    assert {"casadi", "scipy", "typer"} <= {p["name"] for p in content["packages"] if not p["extra"]}
    assert "All is well" in run("doctor").stdout


def test_doctor_reports_what_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> str:
        raise ImportError("no module named casadi")

    monkeypatch.setattr("mpc.cli.doctor._ipopt", broken)
    answer = run("doctor")
    assert answer.exit_code == 1
    assert "ImportError: no module named casadi" in answer.stdout and "FAILED" in answer.stdout
