"""Turns pydantic's findings into messages that name file, key, value and remedy."""

import difflib
import typing
from collections.abc import Iterable

from pydantic import BaseModel, ValidationError

_PROSE = {
    "missing": "this key is required",
    "float_type": "expected a number",
    "int_type": "expected a whole number",
    "bool_type": "expected true or false",
    "string_type": "expected a text in quotes",
    "tuple_type": "expected a list in [ ]",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "finite_number": "expected a finite number",
}


def explain(error: ValidationError, model: type[BaseModel], source: str) -> str:
    """One line per problem: source, path of the key, what is wrong, what was expected."""
    return "\n".join(
        f"{source}: {line}" for line in dict.fromkeys(_line(e, model) for e in error.errors())
    )


def nearest(word: str, known: Iterable[str]) -> str:
    """A suffix for a message: the nearest known word, or all known words."""
    choices = list(known)
    if close := difflib.get_close_matches(word, choices, n=1):
        return f'; did you mean "{close[0]}"?'
    return f"; known: {', '.join(choices)}" if choices else ""


def _line(problem: typing.Any, model: type[BaseModel]) -> str:
    place = problem["loc"]
    path = _path(place)
    value = problem.get("input")
    if problem["type"] == "extra_forbidden":
        return f'{path}: unknown key "{place[-1]}"{nearest(str(place[-1]), _keys(model, place))}'
    if problem["type"] == "value_error":
        message = str(problem["ctx"]["error"])
        return f"{path}: {message}" if path else message
    prose = _PROSE.get(problem["type"], problem["msg"].replace("Input should", "should"))
    if problem["type"] == "missing" or isinstance(value, dict | list):
        return f"{path}: {prose}"
    known = str(problem.get("ctx", {}).get("expected", "")).replace("'", "").replace(" or ", ", ")
    hint = nearest(value, known.split(", ")) if known and isinstance(value, str) else ""
    return f"{path}: {prose}; got {value!r}{hint if 'mean' in hint else ''}"


def _path(place: tuple[int | str, ...]) -> str:
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.lstrip(".")


def _keys(model: type[BaseModel], place: tuple[int | str, ...]) -> list[str]:
    """The keys that the table at a place knows."""
    current: list[type[BaseModel]] = [model]
    for part in place[:-1]:
        fields = [
            field
            for table in current
            for name, field in table.model_fields.items()
            if part == (field.alias or name)
        ]
        if fields:  # otherwise an index, a free name or a union's tag: the table stays
            current = [table for field in fields for table in _models(field.annotation)]
    return [field.alias or name for table in current for name, field in table.model_fields.items()]


def _models(annotation: typing.Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in typing.get_args(annotation) for found in _models(part)]
