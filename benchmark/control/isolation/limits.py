"""How much time and memory an isolated controller gets."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """What ends an isolated controller's episode."""

    step: float = 1.0  # s of wall time for an answer of ``act``
    start: float = 20.0  # s to start and import, again for ``supports``, again for ``reset``
    episode: float = 300.0  # s of wall time for all answers of ``act`` together
    memory: int = 2048  # MB of address space


DEFAULT = Limits()
