"""YAML files that a schema describes: read strictly, and refused by name."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any, get_args

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from thermal.errors import Described, ThermalError, describe, nearest


class _TwiceError(ThermalError):
    """A key that stands twice."""


class _Loader(yaml.SafeLoader):
    """The safe loader, which also refuses a key that stands twice (plain YAML keeps the last one in silence)."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Build a mapping after a look at its keys."""
        lines: dict[str, int] = {}
        for key, _ in node.value:
            line = key.start_mark.line + 1
            if key.value != "<<" and isinstance(key.value, str) and lines.setdefault(key.value, line) != line:
                raise _TwiceError(line, f"{key.value!r}, which line {lines[key.value]} holds too")
        return super().construct_mapping(node, deep=deep)


def read_mapping(path: Path, kind: type[Described], name: str, what: str) -> dict[str, Any]:
    """Read a YAML file that holds a mapping.

    Parameters
    ----------
    path
        The file.
    kind
        Error to raise.
    name
        Of the file, for messages.
    what
        What the file is, for the message where it is not there.

    Raises
    ------
    Described
        The file is missing, no YAML, holds a key twice or no mapping.
    """
    kind.unless(path.is_file(), name, what, "no such file")
    try:
        content = yaml.load(path.read_text(encoding="utf-8-sig"), Loader=_Loader)
    except _TwiceError as error:
        raise _made(kind, f"{name}: line {error.args[0]}", "a new key", error.args[1], "keep one of the two") from error
    except (OSError, UnicodeDecodeError) as error:
        raise _made(kind, name, "YAML in UTF-8", f"{error}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # ValueError: a date such as 2023-13-45
        raise _made(kind, name, "YAML", " ".join(str(error).split())) from error
    kind.unless(isinstance(content, dict), name, "a mapping of keys", f"{type(content).__name__}")
    return dict(content)


def schema_error(error: ValidationError, kind: type[Described], name: str, model: type[BaseModel]) -> Exception:
    """Turn the first of pydantic's findings into an error of a family; say how many more there are.

    Parameters
    ----------
    error
        Of pydantic.
    kind
        Error to make.
    name
        Of the file, for the message.
    model
        Schema of the file. Names of the branches of its unions stand in angle brackets, and not in the message.
    """
    details = error.errors(include_url=False)
    first, more = details[0], f" (and {len(details) - 1} more in this file)" if len(details) > 1 else ""
    *outer, last = first["loc"] or ("",)
    ends = [last] if first["type"] == "extra_forbidden" else []  # what a person wrote may look like a branch
    inside = outer if ends else first["loc"]
    place = [part for part in inside if not (isinstance(part, str) and part.startswith("<"))] + ends
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).removeprefix(".")
    where, found = f"{name}: {path}" if path else name, repr(first["input"])
    if first["type"] == "extra_forbidden":
        key = place[-1]
        fields = model.model_fields
        inner = [] if len(place) == 1 else _models(fields[str(place[0])].annotation)
        keys = [f.alias or k for one in inner or [model] for k, f in one.model_fields.items()]
        return _made(kind, describe(where, "a key of the format", repr(key), nearest(key, keys)) + more)
    if first["type"] == "union_tag_invalid":
        tags, tag = str(first["ctx"]["expected_tags"]), repr(first["ctx"]["tag"])
        key = str(first["ctx"]["discriminator"]).strip("'")
        return _made(kind, describe(f"{where}.{key}", f"one of {tags}", tag) + more)
    if first["type"] == "missing":
        return _made(kind, describe(where, "a value", "no such key") + more)
    found = found if len(found) <= 80 else found[:77] + "..."
    return _made(kind, describe(where, _expected(first), found, _advice(first)) + more)


def _made(kind: type[Described], *parts: str) -> Exception:
    error = kind(*parts)
    return error if isinstance(error, Exception) else Exception(*parts)


def _models(annotation: Any) -> list[type[BaseModel]]:
    """List the models that stand in the annotation of a field."""
    inner = [model for part in get_args(annotation) for model in _models(part)]
    return inner or ([annotation] if isinstance(annotation, type) and issubclass(annotation, BaseModel) else [])


def _expected(detail: ErrorDetails) -> str:
    kinds = {"tuple_type": "a list", "dict_type": "a mapping", "model_type": "a mapping", "string_type": "text"}
    said = detail["msg"].removeprefix("Value error, expected ").removeprefix("Input should be ")
    return kinds.get(detail["type"], said.replace("a valid ", "a "))


def _advice(detail: ErrorDetails) -> str:
    if detail["type"] == "string_type":
        return "put it in quotes" if detail["input"] is not None else ""
    if detail["type"] == "float_type" and isinstance(detail["input"], str):
        return "write a plain number (YAML takes 1e-3 for text: write 1.0e-3 or 0.001)"
    if detail["type"] == "literal_error":
        options = str(detail["ctx"]["expected"]).replace("'", "").replace(" or ", ", ").split(", ")
        return nearest(detail["input"], options)
    return ""
