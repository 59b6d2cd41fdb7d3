"""Turns pydantic's findings into messages that name file, key, value and remedy."""

import difflib
import typing
from collections.abc import Iterable, Iterator

from pydantic import BaseModel, ValidationError

_PROSE = {
    "missing": "this key is required",
    "float_type": "expected a number",
    "float_parsing": "expected a number",
    "int_type": "expected a whole number",
    "int_parsing": "expected a whole number",
    "bool_type": "expected true or false",
    "bool_parsing": "expected true or false",
    "string_type": "expected a text in quotes",
    "tuple_type": "expected a list in [ ]",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "finite_number": "expected a finite number",
    "string_pattern_mismatch": 'expected approach and turn, [NESW]-[LCRU], such as "E-L"',
    "union_tag_not_found": 'the key model = "IDM" or "Krauss" is required',
}

MOST = 20  # problems that are told
LONGEST = 1000  # characters of one


def explain(error: ValidationError, model: type[BaseModel], source: str) -> str:
    """One line per problem: source, path of the key, what is wrong, what was expected."""
    problems = error.errors()
    places = [problem["loc"] for problem in problems]
    lines = [
        _line(problem, model)
        for problem in problems
        # a list with a bad entry counts as too short to pydantic; the entry is reported already
        if problem["type"] != "too_short" or not any(_within(p, problem["loc"]) for p in places)
    ]
    told = [f"{source}: {line[:LONGEST]}" for line in dict.fromkeys(lines)]
    more = [f"{source}: and {len(told) - MOST} more"] if len(told) > MOST else []
    return "\n".join([*told[:MOST], *more])


def _within(place: tuple[int | str, ...], other: tuple[int | str, ...]) -> bool:
    return len(place) > len(other) and place[: len(other)] == other


def nearest(word: str, known: Iterable[str]) -> str:
    """A suffix for a message: the nearest known word, or all known words."""
    choices = list(dict.fromkeys(known))
    if close := difflib.get_close_matches(word, choices, n=1):
        return f'; did you mean "{close[0]}"?'
    return f"; known: {', '.join(choices)}" if choices else ""


def _line(problem: typing.Any, model: type[BaseModel]) -> str:
    place = problem["loc"]
    path = _path(_without_tags(model, place))
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
    choices = known.split(", ") if known else []
    hint = nearest(value, choices) if isinstance(value, str) and value not in choices else ""
    return f"{path}: {prose}; got {value!r}{hint if 'mean' in hint else ''}"


def _path(place: tuple[int | str, ...]) -> str:
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.lstrip(".")


def _tables(
    model: type[BaseModel], place: tuple[int | str, ...]
) -> Iterator[tuple[int | str, bool, list[type[BaseModel]]]]:
    """Each part of a place, whether it is only a union's tag, and the tables it leads to."""
    current: list[type[BaseModel]] = [model]
    for part in place:
        fields = [
            field
            for table in current
            for name, field in table.model_fields.items()
            if part == (field.alias or name)
        ]
        tagged = [
            table
            for table in current
            if len(current) > 1
            and any(part in typing.get_args(f.annotation) for f in table.model_fields.values())
        ]
        if fields:  # otherwise an index, a free name or a union's tag
            current = [table for field in fields for table in _models(field.annotation)]
        elif tagged:
            current = tagged
        yield part, bool(tagged and not fields), current


def _without_tags(model: type[BaseModel], place: tuple[int | str, ...]) -> tuple[int | str, ...]:
    return tuple(part for part, is_tag, _ in _tables(model, place) if not is_tag)


def _keys(model: type[BaseModel], place: tuple[int | str, ...]) -> list[str]:
    """The keys that the table at a place knows."""
    *_, (_, _, tables) = ("", False, [model]), *_tables(model, place[:-1])
    return [field.alias or name for table in tables for name, field in table.model_fields.items()]


def _models(annotation: typing.Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in typing.get_args(annotation) for found in _models(part)]
