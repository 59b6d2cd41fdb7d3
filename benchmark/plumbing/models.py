"""Base classes of validated data: what users write, and what the product writes itself."""

from typing import Annotated

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from benchmark.plumbing.per_cent import share
from benchmark.plumbing.plain import shown

Share = Annotated[
    float, BeforeValidator(share, json_schema_input_type=float | str), Field(ge=0, le=1)
]
"""From 0 to 1, or a text such as ``"40 %"``."""


def _shown(text: str) -> str:
    return text if text.isprintable() else shown(text.encode(errors="replace").decode(), "\n\t")


Words = Annotated[str, AfterValidator(_shown)]
"""Text from elsewhere, such as a controller's error: what UTF-8 cannot hold becomes ``?``, and what
would steer a terminal is written as an escape."""


class Table(BaseModel):
    """A TOML table that a user writes: frozen, strictly typed, unknown keys refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Entry(BaseModel):
    """Part of a record: frozen, unknown keys refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
