"""Lengths, speeds and times: numbers in SI units, or texts such as ``"30 mph"`` and ``"12 ft"``.

A table of a dozen factors: a library of units knows thousands, and takes longer to import than a
scenario to read.
"""

import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

LENGTHS = {"m": 1.0, "cm": 0.01, "km": 1000.0, "ft": 0.3048, "yd": 0.9144, "mi": 1609.344}
SPEEDS = {"m/s": 1.0, "km/h": 1 / 3.6, "kph": 1 / 3.6, "mph": 0.44704, "ft/s": 0.3048}
TIMES = {"s": 1.0, "min": 60.0, "h": 3600.0}
QUANTITY = re.compile(r"\s*([-+]?[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*([^\s\d.].*?)\s*")


def _reader(units: Mapping[str, float]) -> BeforeValidator:
    """Reads a text with one of these units; leaves all else to pydantic."""
    known = ", ".join(units)
    example = "30 mph" if "mph" in units else "15 min" if "min" in units else "12 ft"

    def read(given: Any) -> Any:
        if not isinstance(given, str):
            return given
        if (parts := QUANTITY.fullmatch(given)) is None:
            raise ValueError(f'expected a number, or a text such as "{example}"; got {given!r}')
        if parts[2] not in units:
            raise ValueError(f'unknown unit "{parts[2]}" in {given!r}; expected one of {known}')
        return round(float(parts[1]) * units[parts[2]], 9)  # 0.1 km are 100 m

    return BeforeValidator(read, json_schema_input_type=float | str)


Length = Annotated[float, _reader(LENGTHS)]
"""[m]"""

Speed = Annotated[float, _reader(SPEEDS)]
"""[m/s]"""

Time = Annotated[float, _reader(TIMES)]
"""[s]"""

PositiveLength = Annotated[Length, Field(gt=0)]
PositiveSpeed = Annotated[Speed, Field(gt=0)]
PositiveTime = Annotated[Time, Field(gt=0)]
