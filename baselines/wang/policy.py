"""Wang's network in numpy: what decides in episodes, without torch or the training extras."""

from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field, PositiveInt
from threadpoolctl import threadpool_limits

from benchmark.learning.observation import Layout, Numbers, size

if TYPE_CHECKING:
    from benchmark.learning.rollout import Actions  # brings the simulation

HIDDEN = (512, 512, 512)  # widths of the hidden layers (Wang et al.)
ACTIONS = 2  # Stop, Go
FEW = 3  # rows up to which one after another is faster: a matrix product first packs the weights


class Network(BaseModel):
    """What the notes of a weights' file say of its network; without notes, as published."""

    layout: Layout = "paper"
    hidden: tuple[PositiveInt, ...] = Field(HIDDEN, min_length=1)
    atoms: PositiveInt = 51

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Of its arrays."""
        return shapes(self.layout, self.hidden, self.atoms)


def shapes(layout: Layout, hidden: tuple[int, ...], atoms: int) -> dict[str, tuple[int, ...]]:
    """The arrays of a network by name, with their shapes: weights are (outputs, inputs)."""
    widths = [size(layout), *hidden]
    arrays: dict[str, tuple[int, ...]] = {}
    for index, (inputs, outputs) in enumerate(pairwise(widths)):
        arrays |= {f"trunk.{index}.weight": (outputs, inputs), f"trunk.{index}.bias": (outputs,)}
    for head, outputs in (("value", atoms), ("advantage", ACTIONS * atoms)):
        arrays |= {f"{head}.weight": (outputs, widths[-1]), f"{head}.bias": (outputs,)}
    return arrays if atoms == 1 else {**arrays, "support": (atoms,)}


class Greedy:
    """Takes the action of highest value for each row; one forward pass for all.

    Args:
        arrays: the network's, by the names of ``shapes``.
    """

    def __init__(self, arrays: Mapping[str, Numbers]) -> None:
        self._arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}

    def __getstate__(self) -> dict[str, object]:
        return {"_arrays": self._arrays}

    @cached_property
    def _layers(self) -> list[tuple[Numbers, Numbers]]:
        threadpool_limits(1)  # small products: threads cost time, and other bits with other counts
        trunk = sum(name.startswith("trunk") for name in self._arrays) // 2
        return [self._layer(f"trunk.{index}") for index in range(trunk)]

    def _layer(self, name: str) -> tuple[Numbers, Numbers]:
        return self._arrays[f"{name}.weight"].T, self._arrays[f"{name}.bias"]

    @cached_property
    def _head(self) -> tuple[Numbers, Numbers]:
        """Both heads as one layer that yields values of (rows, ACTIONS * atoms)."""
        value, advantage = self._layer("value"), self._layer("advantage")
        atoms = value[1].size
        joined = []
        for one, other in zip(value, advantage, strict=True):
            parts = other.reshape(*other.shape[:-1], ACTIONS, atoms)
            centred = parts - parts.mean(axis=-2, keepdims=True) + one[..., None, :]
            joined.append(np.ascontiguousarray(centred.reshape(other.shape)))
        return joined[0], joined[1]

    def values(self, observations: Numbers) -> Numbers:
        """Expected returns.

        Args:
            observations: (rows, size of the observation).

        Returns:
            (rows, 2): of Stop and of Go.
        """
        hidden = observations
        for weight, bias in self._layers:
            hidden = np.maximum(hidden @ weight + bias, 0.0)
        weight, bias = self._head
        hidden = hidden @ weight + bias
        if (support := self._arrays.get("support")) is None:
            return hidden
        logits = hidden.reshape(len(hidden), ACTIONS, support.size)
        chances = np.exp(logits - logits.max(axis=-1, keepdims=True))
        expected: Numbers = (chances @ support) / chances.sum(axis=-1)
        return expected

    def __call__(self, observations: Numbers) -> "Actions":
        """The better action for each row."""
        if 0 < len(observations) <= FEW:
            values = np.concatenate([self.values(row[None]) for row in observations])
        else:
            values = self.values(observations)
        chosen: npt.NDArray[np.int64] = values.argmax(axis=1)
        return chosen
