import inspect

import pytest

from thermal import errors
from thermal.errors import ThermalError, describe, nearest

FAMILY = [kind for _, kind in inspect.getmembers(errors, inspect.isclass) if issubclass(kind, Exception)]


@pytest.mark.parametrize("kind", FAMILY)
def test_one_family_with_a_line_of_documentation_each(kind: type[Exception]) -> None:
    assert issubclass(kind, ThermalError)
    assert kind.__doc__ and "\n" not in kind.__doc__.strip()


def test_message_says_where_expected_found_and_what_to_do() -> None:
    message = describe("building.yaml: devices[2]: zone", "a zone", repr("F1_X"), "rename it")
    assert message == "building.yaml: devices[2]: zone: expected a zone, found 'F1_X'; rename it"


def test_nearest_option() -> None:
    assert nearest("livng", ["kitchen", "living"]) == "the nearest valid one is 'living'"
    assert nearest("LIVING", ["living"]) == "the nearest valid one is 'living'"
    assert nearest("zzz", ["a", "b"]) == "valid: a, b"
    assert nearest("zzz", [str(i) for i in range(20)]) == "valid: 0, 1, 2, 3, 4, 5, 6, 7 and 12 more"
    assert nearest("x", []) == "there is none to choose from"
