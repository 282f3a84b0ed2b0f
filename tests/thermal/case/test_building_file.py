"""Every way in which `building.yaml` can be wrong by itself."""

from pathlib import Path
from typing import Any

import pytest

from thermal.case.load import load_case
from thermal.errors import CaseError


def set_at(content: dict[str, Any], path: tuple[Any, ...], value: object) -> None:
    """Set a value deep inside a draft's content; None as the value deletes the key."""
    for part in path[:-1]:
        content = content[part]
    if value is None:
        del content[path[-1]]
    else:
        content[path[-1]] = value


def test_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"nowhere: path: expected a case folder, found nothing"):
        load_case(tmp_path / "nowhere")


def test_file_instead_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "building.yaml").write_text("format: 1\n")
    with pytest.raises(CaseError, match="expected a case folder, found a file"):
        load_case(tmp_path / "building.yaml")


def test_folder_without_building_file(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"building\.yaml: .*no such file"):
        load_case(tmp_path)


@pytest.mark.parametrize(
    "text", ["a: [1,\n", "a: 1\n b: 2\n", "@", "date: 2023-13-45\n", "a: !!python/object:os.system {}"]
)
def test_text_that_is_not_yaml(tmp_path: Path, text: str) -> None:
    (tmp_path / "building.yaml").write_text(text)
    with pytest.raises(CaseError, match=r"building\.yaml: expected YAML"):
        load_case(tmp_path)


@pytest.mark.parametrize("text", ["", "- 1\n- 2\n", "just a text\n"])
def test_yaml_that_is_no_mapping(tmp_path: Path, text: str) -> None:
    (tmp_path / "building.yaml").write_text(text)
    with pytest.raises(CaseError, match=r"expected a mapping of keys, found (NoneType|list|str)"):
        load_case(tmp_path)


def test_building_file_of_another_encoding(tmp_path: Path) -> None:
    (tmp_path / "building.yaml").write_bytes("name: Küche\n".encode("latin-1"))
    with pytest.raises(CaseError, match=r"building\.yaml: expected YAML in UTF-8"):
        load_case(tmp_path)


def test_key_that_stands_twice(plan_draft: Any) -> None:
    folder = plan_draft.write()
    path = folder / "building.yaml"
    path.write_text(path.read_text() + "name: another\n")
    with pytest.raises(CaseError, match=r"line \d+: expected a new key, found 'name', which line 2 holds too"):
        load_case(folder)


@pytest.mark.parametrize("number", [4, 0, "1", True, 1.5])
def test_other_format_numbers(plan_draft: Any, number: object) -> None:
    plan_draft.content["format"] = number
    with pytest.raises(CaseError, match=r"building\.yaml: format: expected 1, 2 or 3, found"):
        load_case(plan_draft.write())


def test_format_is_looked_at_before_anything_else(plan_draft: Any) -> None:
    plan_draft.content |= {"format": 4, "new_key_of_format_4": 1}
    with pytest.raises(CaseError):
        load_case(plan_draft.write())


@pytest.mark.parametrize(
    ("draft", "path"),
    [
        ("plan_draft", ("format",)),
        ("plan_draft", ("name",)),
        ("plan_draft", ("location",)),
        ("plan_draft", ("location", "timezone")),
        ("plan_draft", ("location", "elevation")),
        ("plan_draft", ("telemetry",)),
        ("plan_draft", ("units",)),
        ("plan_draft", ("cell_size",)),
        ("plan_draft", ("floors",)),
        ("plan_draft", ("floors", 0, "height")),
        ("plan_draft", ("devices", 0, "type")),
        ("plan_draft", ("airflows", 0, "from")),
        ("plan_draft", ("airflows", 0, "fraction")),
        ("table_draft", ("zones",)),
        ("table_draft", ("zones", 1, "volume")),
        ("table_draft", ("surfaces", 0, "area")),
        ("table_draft", ("constructions", "brick", 0, "density")),
    ],
)
def test_missing_keys(request: pytest.FixtureRequest, draft: str, path: tuple[Any, ...]) -> None:
    case = request.getfixturevalue(draft)
    set_at(case.content, path, None)
    with pytest.raises(CaseError, match=rf"building\.yaml: .*{path[-1]}: expected .*, found no such key"):
        load_case(case.write())


@pytest.mark.parametrize(
    ("draft", "path", "near"),
    [
        ("plan_draft", ("orientaton",), "orientation"),
        ("plan_draft", ("Telemetry",), "telemetry"),
        ("plan_draft", ("location", "time_zone"), "timezone"),
        ("plan_draft", ("floors", 0, "heigth"), "height"),
        ("plan_draft", ("devices", 1, "zones"), "zone"),
        ("plan_draft", ("airflows", 0, "fractions"), "fraction"),
        ("table_draft", ("zones", 0, "floorarea"), "floor_area"),
        ("table_draft", ("surfaces", 1, "uvalue"), "u_value"),
        ("table_draft", ("constructions", "brick", 0, "thicknes"), "thickness"),
    ],
)
def test_unknown_keys_name_the_nearest(
    request: pytest.FixtureRequest, draft: str, path: tuple[Any, ...], near: str
) -> None:
    case = request.getfixturevalue(draft)
    set_at(case.content, path, 1.0)
    with pytest.raises(CaseError, match=rf"'{path[-1]}'; the nearest valid one is '{near}'"):
        load_case(case.write())


@pytest.mark.parametrize("path", [("<spoilt>",), ("location", "<spoilt>")])
def test_unknown_keys_that_look_like_a_branch_of_the_schema(plan_draft: Any, path: tuple[Any, ...]) -> None:
    set_at(plan_draft.content, path, 1.0)
    with pytest.raises(CaseError, match="<spoilt>: expected a key of the format, found '<spoilt>'"):
        load_case(plan_draft.write())


NAN = float("nan")


@pytest.mark.parametrize(
    ("draft", "path", "value", "message"),
    [
        ("plan_draft", ("cell_size",), 0.0, "cell_size: expected greater than 0, found 0.0"),
        ("plan_draft", ("cell_size",), -0.5, "cell_size: expected greater than 0"),
        ("plan_draft", ("cell_size",), NAN, "cell_size: expected a finite number, found nan"),
        ("plan_draft", ("cell_size",), float("inf"), "cell_size: expected a finite number"),
        ("plan_draft", ("cell_size",), "0.5", "cell_size: expected a number, found '0.5'; write a plain number"),
        ("plan_draft", ("cell_size",), True, "cell_size: expected a number, found True"),
        ("plan_draft", ("orientation",), NAN, "orientation: expected a finite number"),
        ("plan_draft", ("orientation",), 400.0, "orientation: expected less than or equal to 360"),
        ("plan_draft", ("floors",), [], "floors: expected at least one entry, found none"),
        ("plan_draft", ("floors",), {"F1": 1}, "floors: expected a list"),
        ("plan_draft", ("floors", 0, "height"), -3, r"floors\[0\]\.height: expected greater than 0, found -3"),
        ("plan_draft", ("location", "latitude"), 91.0, r"location\.latitude: expected less than or equal to 90"),
        ("plan_draft", ("location", "longitude"), -181.0, r"location\.longitude: expected greater than or equal"),
        ("plan_draft", ("location",), "Chicago", "location: expected a mapping, found 'Chicago'"),
        ("plan_draft", ("glazing", "A", "south"), -1.0, r"glazing\.A\.south: expected greater than or equal to 0"),
        ("plan_draft", ("glazing", "A", "south"), NAN, r"glazing\.A\.south: expected a finite number"),
        ("plan_draft", ("devices", 0, "zone"), 101, r"devices\[0\]\.zone: expected text, found 101; put it in quotes"),
        ("plan_draft", ("devices", 0, "name"), "", r"devices\[0\]\.name: "),
        ("plan_draft", ("airflows", 0, "fraction"), 0.0, r"airflows\[0\]\.fraction: expected greater than 0"),
        ("plan_draft", ("airflows", 0, "fraction"), 1.1, r"airflows\[0\]\.fraction: expected less than or equal to 1"),
        ("plan_draft", ("units", "heating_power_sensor"), 1, "units.heating_power_sensor: expected text, found 1"),
        ("table_draft", ("zones",), [], "zones: expected at least one entry"),
        ("table_draft", ("zones", 0, "volume"), 0, r"zones\[0\]\.volume: expected greater than 0"),
        ("table_draft", ("surfaces", 0, "area"), -9.0, r"surfaces\[0\]\.area: expected greater than 0, found -9"),
        ("table_draft", ("surfaces", 0, "area"), NAN, r"surfaces\[0\]\.area: expected a finite number"),
        ("table_draft", ("surfaces", 0, "azimuth"), NAN, r"surfaces\[0\]\.azimuth: expected a finite number"),
        ("table_draft", ("surfaces", 0, "kind"), "wal", r"surfaces\[0\]\.kind: .*the nearest valid one is 'wall'"),
        ("table_draft", ("surfaces", 1, "u_value"), 0.0, r"surfaces\[1\]\.u_value: expected greater than 0"),
        (
            "table_draft",
            ("surfaces", 1, "solar_transmittance"),
            1.2,
            "solar_transmittance: expected less than or equal",
        ),
        ("table_draft", ("constructions", "brick", 0, "conductivity"), -1.0, r"brick\[0\]\.conductivity: expected gr"),
    ],
)
def test_values_of_the_wrong_kind_or_size(
    request: pytest.FixtureRequest, draft: str, path: tuple[Any, ...], value: object, message: str
) -> None:
    case = request.getfixturevalue(draft)
    set_at(case.content, path, value)
    with pytest.raises(CaseError, match=message):
        load_case(case.write())


def test_several_mistakes_are_counted(plan_draft: Any) -> None:
    plan_draft.content["cell_size"] = -1.0
    plan_draft.content["floors"][0]["height"] = -1.0
    with pytest.raises(CaseError, match=r"cell_size.*\(and 1 more in this file\)"):
        load_case(plan_draft.write())


def test_plans_and_table_at_once(plan_draft: Any, table_draft: Any) -> None:
    plan_draft.content["zones"] = table_draft.content["zones"]
    with pytest.raises(CaseError, match="keys of both: cell_size, floors, glazing, zones"):
        load_case(plan_draft.write())


def test_neither_plans_nor_table(table_draft: Any) -> None:
    for key in ("zones", "surfaces", "constructions"):
        del table_draft.content[key]
    with pytest.raises(CaseError, match=r"expected 'floors' \(plans\) or 'zones' .*, found neither"):
        load_case(table_draft.write())


@pytest.mark.parametrize("name", ["Europe/Berln", "UTC+1", "", "../etc/passwd", "Europe"])
def test_time_zone_that_is_not_iana(plan_draft: Any, name: str) -> None:
    plan_draft.content["location"]["timezone"] = name
    with pytest.raises((CaseError), match=r"location\.timezone"):
        load_case(plan_draft.write())


def test_time_zone_names_the_nearest(plan_draft: Any) -> None:
    plan_draft.content["location"]["timezone"] = "Europe/Berln"
    with pytest.raises(CaseError, match="the nearest valid one is 'Europe/Berlin'"):
        load_case(plan_draft.write())


def test_every_message_begins_with_the_folder(plan_draft: Any) -> None:
    plan_draft.content["cell_size"] = -1.0
    with pytest.raises(CaseError) as caught:
        load_case(plan_draft.write())
    assert str(caught.value).startswith(f"{plan_draft.folder}: building.yaml: cell_size: ")
