"""What passes between the runner and an isolated controller: typed messages in framed bytes.

Data only, in MessagePack: to decode a message never runs code that came with it.
"""

import socket
import time as clock
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Annotated, Any, Self

import msgspec
from msgspec import Meta, Struct

from benchmark.control.commands import Written
from benchmark.control.declarations import Declaration
from benchmark.control.intersection import Intersection
from benchmark.control.state import Crossing, TrafficState, Vehicle
from benchmark.scenario.scenario import Scenario

LARGEST = 256 * 1024  # bytes of an answer; commands to a hundred vehicles have four thousand
HEADER = 4  # bytes that say how long a message is

Name = Annotated[str, Meta(max_length=200)]
Text = Annotated[str, Meta(max_length=4000)]


class Message(Struct, array_like=True, tag=True):
    """A message; its class is told by its tag."""


class Open(Message):
    """Import this controller."""

    reference: str
    folder: str  # where relative paths in the reference begin
    path: tuple[str, ...]  # folders to import from, before all others
    readable: tuple[str, ...]  # files and folders that may be read
    listed: tuple[str, ...]  # folders whose entries may be listed
    memory: int  # MB
    runner: int  # id of its process


class Ask(Message):
    """Say what you make of a scenario."""

    text: str  # JSON
    name: str

    @classmethod
    def about(cls, scenario: Scenario) -> Self:
        """The question about this scenario."""
        return cls(scenario.model_dump_json(by_alias=True), scenario.name)

    def scenario(self) -> Scenario:
        """The scenario in question."""
        scenario = Scenario.model_validate_json(self.text)
        scenario._name = self.name
        return scenario


class Begin(Message):
    """A new episode begins at these junctions."""

    seed: int
    junctions: dict[str, Intersection]


class See(Message):
    """The traffic at a junction; what does not change was in ``Begin``."""

    junction: str
    time: float
    vehicles: tuple[Vehicle, ...]
    inside: tuple[Crossing, ...]
    phase: str | None

    def state(self, intersection: Intersection) -> TrafficState:
        """As controllers see it."""
        return TrafficState(intersection, self.time, self.vehicles, self.inside, self.phase)


class Try(Message):
    """Try what isolation is to keep out."""

    victim: str  # a file that is not the controller's


class Tried(Message):
    """What came of each attempt."""

    outcomes: dict[str, Text]


class Declared(Message):
    """What the controller's class says of itself."""

    declaration: Declaration


class Answer(Message):
    """What the controller makes of a scenario."""

    unsupported: Text | None
    weights_hash: Name | None
    programs: str  # JSON
    trained_on: str  # JSON


class Begun(Message):
    """The controllers are reset."""


class Commands(Message):
    """The answer to ``See``, in the order in which the controller gave it."""

    commands: list[Written]


class Fault(Message):
    """The controller raised."""

    reason: Text


QUESTIONS = Open | Ask | Begin | See | Try
ANSWERS = Declared | Tried | Answer | Begun | Commands | Fault


class MalformedError(Exception):
    """An answer that is too long or not of the agreed types."""


class Channel:
    """One end of the connection.

    Args:
        end: its socket.
        kinds: union of the messages that arrive here.
        largest: bytes that an arriving message may have.
    """

    def __init__(self, end: socket.socket, kinds: Any, largest: int = 2**32) -> None:
        self._socket, self._largest = end, largest
        self._encode = msgspec.msgpack.Encoder(enc_hook=_plain).encode
        self._decode = msgspec.msgpack.Decoder(kinds).decode

    def send(self, message: Message, deadline: float | None = None) -> None:
        """Send a message.

        Args:
            message: to be sent.
            deadline: in ``time.perf_counter`` [s]; None waits for ever.

        Raises:
            TimeoutError: the deadline has passed.
            OSError: the other end is gone.
        """
        data = self._encode(message)
        self._wait_until(deadline)
        self._socket.sendall(len(data).to_bytes(HEADER) + data)

    def receive(self, deadline: float | None = None) -> Any:
        """The next message.

        Raises:
            TimeoutError, OSError: as ``send``.
            EOFError: the other end is closed.
            MalformedError: what arrived is no message.
        """
        length = int.from_bytes(self._read(HEADER, deadline))
        if length > self._largest:
            raise MalformedError(f"{length} bytes; at most {self._largest} are allowed")
        data = self._read(length, deadline)
        try:
            return self._decode(data)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
            raise MalformedError(str(error)) from error

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def _read(self, count: int, deadline: float | None) -> bytes:
        parts = []
        while count:
            self._wait_until(deadline)
            part = self._socket.recv(min(count, 1 << 16))
            if not part:
                raise EOFError
            parts.append(part)
            count -= len(part)
        return b"".join(parts)

    def _wait_until(self, deadline: float | None) -> None:
        """The socket's next call ends at the deadline, however slowly bytes trickle in."""
        if deadline is None:
            return
        left = deadline - clock.perf_counter()
        if left <= 0:
            raise TimeoutError
        self._socket.settimeout(left)


def _plain(value: object) -> Any:
    if isinstance(value, MappingProxyType):
        return dict(value)
    raise NotImplementedError(f"{type(value).__name__} has no place in a message")


def read_only(intersection: Intersection) -> Intersection:
    """An intersection that arrived here, with tables that cannot be changed again."""
    tables: Mapping[str, Any] = {
        name: MappingProxyType(getattr(intersection, name))
        for name in ("lanes", "movements", "phases")
    }
    return replace(intersection, **tables)
