"""A table of meters becomes savings with checks, from units to the page; our own plant tells its true saving."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpc.cli.app import app
from mpc.errors import VerificationError
from mpc.verification.baseline import fit_baseline, judge_baseline
from mpc.verification.metered import Metered, MeteredColumns, read_metered
from mpc.verification.validity import Check
from mpc.verification.verify import Verification, VerificationSettings, verify

MakeDays = Callable[..., pd.DataFrame]
COLUMNS = MeteredColumns(("main [kW]",), "outdoor", "mode")


def checks_of(found: Verification, design: int = -1) -> Mapping[str, Check]:
    return {check.name: check for check in found.savings[design].checks}


def metered(table: pd.DataFrame, tmp_path: Path, columns: MeteredColumns = COLUMNS) -> Metered:
    file = tmp_path / "meters.parquet"
    table.to_parquet(file)
    return read_metered(str(file), columns, "Etc/GMT-1")


def test_counters_units_and_days(make_days: MakeDays, by_hour: MakeDays, tmp_path: Path) -> None:
    days = make_days(0, "pairs")
    table = by_hour(days)
    energy = table["main [kW]"].cumsum().rename("main [kWh]")
    both = pd.concat([energy, (1.8 * table["outdoor"] + 32.0).rename("outdoor [degF]"), table["mode"]], axis=1)
    found = metered(both, tmp_path, MeteredColumns(("main [kWh]",), "outdoor [degF]", "mode")).days()
    assert found["power"].to_numpy()[1:] == pytest.approx(days["power"].to_numpy()[1:], rel=1e-6)
    assert found["outdoor"].to_numpy() == pytest.approx(days["outdoor"].to_numpy(), abs=1e-6)
    assert np.array_equal(found["acts"], days["acts"]) and np.array_equal(found["weekend"], days["weekend"])
    table.iloc[24:30, 0] = np.nan
    assert np.isnan(metered(table, tmp_path).days()["power"].iloc[1])
    with pytest.raises(VerificationError, match="a unit of power or energy"):
        metered(table.rename(columns={"main [kW]": "main [m3]"}), tmp_path, MeteredColumns(("main [m3]",), "outdoor"))
    with pytest.raises(VerificationError, match="nearest|did you mean|valid"):
        metered(table, tmp_path, MeteredColumns(("main",), "outdoor"))


def test_checks_find_what_makes_a_saving_invalid(make_days: MakeDays, by_hour: MakeDays, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    days = make_days(2, "random", n=56, carry=0.15)
    new = np.repeat(days["acts"].to_numpy(), 24)
    after = np.repeat(np.concatenate([[0.0], days["acts"].to_numpy()[:-1]]), 24)
    noise = rng.normal(scale=0.1, size=24 * 56)
    table = by_hour(days, people=40.0 - 10.0 * new + noise, rooms=21.0 - 1.0 * new - 0.5 * after + noise)
    columns = MeteredColumns(("main [kW]",), "outdoor", "mode", "people", "rooms")
    found = checks_of(verify(metered(table, tmp_path, columns)))
    assert {n for n in ("occupancy", "service", "carry-over") if found[n].passed is False} == {
        "occupancy", "service", "carry-over",
    }  # fmt: skip
    sound = by_hour(make_days(2, "random", n=56), people=40.0 + noise, rooms=21.0 + noise)
    told = checks_of(verify(metered(sound, tmp_path, columns)))
    assert all(told[name].passed for name in ("occupancy", "service", "weather", "missing days"))
    strict = checks_of(verify(metered(by_hour(make_days(2, "alternate", n=56)), tmp_path)))
    assert strict["carry-over"].passed is None and "two days or more" in strict["carry-over"].advice
    few = checks_of(verify(metered(by_hour(make_days(2, "weeks", n=28)), tmp_path)))
    assert few["days"].passed is False and "switch more often" in few["days"].advice
    lost = by_hour(make_days(2, "pairs", n=56))
    lost.iloc[:240, 0] = np.nan
    assert checks_of(verify(metered(lost.iloc[200:], tmp_path)))["days"] is not None
    lost.iloc[480:720, 0] = np.nan
    assert checks_of(verify(metered(lost, tmp_path)))["missing days"].passed is False


def test_weather_that_the_baseline_has_not_seen(make_days: MakeDays, by_hour: MakeDays, tmp_path: Path) -> None:
    days = make_days(4, np.repeat([0.0, 1.0], [60, 30]), n=90)
    days.iloc[60:, 1] -= 15.0
    start = days.index[0]
    periods = [(start, start + pd.Timedelta(days=60)), (start + pd.Timedelta(days=60), start + pd.Timedelta(days=90))]
    found = verify(metered(by_hour(days), tmp_path), VerificationSettings(*periods))
    assert [s.design for s in found.savings] == ["before and after"]
    check = checks_of(found)["weather"]
    assert check.passed is False and "extend the baseline" in check.advice


def test_time_of_week_follows_the_hours(make_days: MakeDays, by_hour: MakeDays, tmp_path: Path) -> None:
    days = make_days(5, np.zeros(56), n=56, rho=0.0)
    table = by_hour(days)
    hour = (table.index - pd.Timedelta(hours=1)).hour
    table["main [kW]"] += 30.0 * ((hour >= 8) & (hour < 18))
    hours = metered(table, tmp_path).hours
    model = fit_baseline(hours, "time-of-week")
    fit = judge_baseline(model, hours)
    assert fit.cv_rmse < 0.1 and abs(fit.nmbe) < 1e-9 and fit.held_out_cv_rmse < 0.15
    assert {9, 33, 57} <= model.occupied and 3 not in model.occupied
    flat = np.ones(len(hours)) * hours["power"].mean()
    assert fit.r_squared > 0.8 and np.std(model.predict(hours) - flat) > 1e4


def test_shadow_is_held_against_what_was_realised(make_days: MakeDays, by_hour: MakeDays, tmp_path: Path) -> None:
    acts = np.concatenate([np.zeros(14), np.arange(56) // 2 % 2])
    days = make_days(6, acts, n=70, saving=0.15)
    own = np.repeat(days["acts"].to_numpy() == 0.0, 24)
    columns = MeteredColumns(("main [kW]",), "outdoor", "mode", predicted="expected [kW]")
    for share, differs in ((0.15, False), (0.4, True)):
        table = by_hour(days)
        table["expected [kW]"] = np.where(own, share * table["main [kW]"], np.nan)
        found = verify(metered(table, tmp_path, columns))
        assert found.predicted is not None and found.shortfall is not None
        assert found.predicted.value == pytest.approx(share, abs=0.005)
        low, high = found.shortfall.interval(0.9)
        assert (not low <= 0.0 <= high) == differs


def test_a_rehearsal_is_what_shadow_expected(
    make_days: MakeDays, by_hour: MakeDays, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Days of shadow that acting is said to save 15 % of, beside days that saved 15 %."""
    days = make_days(6, np.concatenate([np.zeros(14), np.arange(56) // 2 % 2]), n=70, saving=0.15)
    table, out = by_hour(days), tmp_path / "saved"
    table.to_parquet(tmp_path / "meters.parquet")
    daily = metered(table, tmp_path, COLUMNS).days()["power"].iloc[:14] * 86400.0 / 3.6e6
    told = pd.DataFrame({"own_energy": 0.9 * daily, "energy": 0.75 * daily})
    told.to_parquet(tmp_path / "days.parquet")
    given = ["verify", str(tmp_path / "meters.parquet"), "--power", "main [kW]", "--outdoor", "outdoor", "--acts", "mode",
             "--tz", "Etc/GMT-1", "--out", str(out)]  # fmt: skip
    with pytest.raises(SystemExit) as ended:
        app([*given, "--rehearsed", str(tmp_path / "days.parquet")])
    assert ended.value.code == 0, capsys.readouterr().err
    found = json.loads((out / "verification.json").read_text())
    assert found["predicted"]["value"] == pytest.approx(0.15, abs=1e-9)
    low, high = found["realised_less_predicted"]["interval"]
    assert low < 0.0 < high
    read = metered(table, tmp_path, COLUMNS)
    with pytest.raises(VerificationError, match="days that were metered, found 2027-"):
        read.with_rehearsed(told.set_index(told.index + pd.DateOffset(years=1)))
    with pytest.raises(VerificationError, match="own_energy and energy .* found cost"):
        read.with_rehearsed(pd.DataFrame({"cost": 1.0}, index=told.index))
    for bad, says in (("meters.csv", "a rehearsal"), ("days.parquet", "it or --predicted, found both")):
        (tmp_path / "meters.csv").write_text("no parquet")
        more = ["--predicted", "x"] if bad == "days.parquet" else []
        with pytest.raises(SystemExit) as ended:
            app([*given, "--force", "--rehearsed", str(tmp_path / bad), *more])
        assert ended.value.code == 2 and says in capsys.readouterr().err


def test_the_command_writes_a_page(
    make_days: MakeDays, by_hour: MakeDays, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "meters.parquet", tmp_path / "saved"
    by_hour(make_days(7, "pairs", n=56)).to_parquet(file)
    given = ["verify", str(file), "--power", "main [kW]", "--outdoor", "outdoor", "--acts", "mode", "--tz", "Etc/GMT-1"]
    with pytest.raises(SystemExit) as ended:
        app([*given, "--out", str(out)])
    assert ended.value.code == 0 and "Energy saved" in capsys.readouterr().out
    content = json.loads((out / "verification.json").read_text())
    saving = content["savings"][0]
    low, high = saving["share"]["interval"]
    assert low < saving["share"]["value"] < high and saving["design"] == "alternate days"
    assert len(pd.read_parquet(out / "days.parquet")) == saving["days"] == 55
    assert "alternate days" in (out / "report.html").read_text()
    with pytest.raises(SystemExit) as refused:
        app([*given[:-4], "--tz", "Etc/GMT-1", "--out", str(tmp_path / "none")])
    assert refused.value.code == 2 and "--baseline and --reporting" in capsys.readouterr().err


@pytest.mark.long
def test_alternate_days_of_our_plant_tell_its_true_saving() -> None:
    from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
    from mpc.loop.noise import SensorNoise
    from mpc.loop.run import run_closed_loop
    from thermal.pilot.building import pilot_building
    from thermal.system.sizing import size_system

    building = pilot_building(1, floor_area=300.0, zones=6, name="office")
    count, start = 43, pd.Timestamp("2023-01-09", tz="Etc/GMT+8")
    weather = pilot_weather(1, "2023-01-09", float(count), 900.0)
    chosen = PlantSettings(step_seconds=900.0, control_steps=4, dx=1.0, order=40, noise=SensorNoise(),
                           system=size_system(building))  # fmt: skip
    plant = simulated_plant(building, weather, "2023-01-09", "2023-02-21", chosen)
    own = dict(plant.default_actions)
    new = {name: value + 1.5 if "supply_air_temperature" in name else value for name, value in own.items()}

    class Alternating:
        def __init__(self, acts: np.ndarray) -> None:
            self.acts = acts

        def step(self, measurements: Any, forecast: Any) -> dict[str, float]:
            day = (measurements.stamp - start).days
            return new if self.acts[min(day, count - 1)] else own

    def daily_power(acts: np.ndarray) -> np.ndarray:
        record = run_closed_loop(plant, Alternating(acts)).record
        gas = np.zeros_like(record.electricity) if record.gas is None else record.gas
        return (record.electricity + gas).reshape(count, -1).mean(axis=1)

    outdoor = weather.frame["outside_air_temperature_sensor"].to_numpy().reshape(count, -1).mean(axis=1)
    truth = 1.0 - daily_power(np.ones(count)).sum() / daily_power(np.zeros(count)).sum()
    acts = np.arange(count) % 2 * 1.0
    index = pd.date_range(start, periods=count)
    weekend = (index.day_of_week >= 5).astype(float)
    from mpc.verification.switchback import switchback

    table = {"power": daily_power(acts), "outdoor": outdoor, "weekend": weekend, "acts": acts}
    found = switchback(pd.DataFrame(table, index=index))
    low, high = found.share.interval(0.9)
    assert truth > 0.1 and low <= truth <= high and low > 0.0
