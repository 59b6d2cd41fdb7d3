"""Base classes of validated data: what users write, and what the product writes itself."""

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Share = Annotated[float, Field(ge=0, le=1)]

Words = Annotated[str, AfterValidator(lambda text: text.encode(errors="replace").decode())]
"""Text from elsewhere, such as a controller's error; what UTF-8 cannot hold becomes ``?``."""


class Table(BaseModel):
    """A TOML table that a user writes: frozen, strictly typed, unknown keys refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Entry(BaseModel):
    """Part of a record: frozen, unknown keys refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
