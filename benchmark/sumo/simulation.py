"""The only door to libsumo: start, step, read, steer, close.

libsumo holds one simulation per process, so there is at most one open ``Simulation`` at a time;
episodes run in worker processes (``benchmark.study.pool``).
"""

import contextlib
import gc
import os
import sys
import tempfile
import traceback
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self
from xml.etree import ElementTree

from benchmark.control.state import Body
from benchmark.plumbing.errors import NetworkError, UsageError
from benchmark.sumo import tools
from benchmark.sumo.junction import Junction

CHECKED = 31  # SUMO's speedMode: safe speed, acceleration bounds, right of way, red lights

FLAGS = {
    "--time-to-teleport": "-1",  # a jam stays a jam
    "--collision.action": "warn",  # counted, and nobody is moved away
    "--collision.check-junctions": "true",
    "--tripinfo-output.write-unfinished": "true",
    "--tripinfo-output.write-undeparted": "true",
    "--device.emissions.probability": "0.1",  # every tenth vehicle: all would cost a fifth of a run
    "--device.emissions.deterministic": "true",  # the same ones under every controller
    "--xml-validation": "never",  # our own files
    "--xml-validation.net": "never",
    "--xml-validation.routes": "never",
    "--no-step-log": "true",
    "--no-warnings": "true",
    "--duration-log.disable": "true",
}


Reading = tuple[str, str, float, float]
"""A vehicle's id, its lane, its distance or position [m] and its speed [m/s]."""


class Pose(NamedTuple):
    """Where a vehicle is and where it heads."""

    id: str
    x: float  # m, of the middle of its front bumper
    y: float  # m
    angle: float  # degrees clockwise from north
    speed: float  # m/s


class Size(NamedTuple):
    """How large the vehicles of a class are."""

    length: float  # m
    width: float  # m


@dataclass(frozen=True, slots=True)
class Emissions:
    """What a vehicle emitted on its whole trip, by SUMO's model."""

    co2: float  # g
    nox: float  # mg
    fuel: float  # g


@dataclass(frozen=True, slots=True)
class Trip:
    """What SUMO reports of one vehicle at the end."""

    id: str
    depart: float | None  # s, when it entered; None if it never did
    arrival: float | None  # s; None if it was still under way
    insertion_delay: float  # s it waited to enter
    duration: float  # s on the road
    time_loss: float  # s lost against driving freely
    distance: float  # m
    emissions: Emissions | None  # None where SUMO did not record them
    meddled: bool = False  # taken away, or made to stop, by other means than the benchmark's


class Simulation:
    """One run of SUMO; a context manager.

    Args:
        network: the network file.
        routes: the route file.
        program: the additional file with the traffic lights' programs.
        step: simulated time per step [s].
        seed: of the episode.
        window: show the run in sumo-gui.
        owner: whose run it is, for messages.

    Raises:
        NetworkError: SUMO refuses the files or stops with an error.
    """

    _owner: ClassVar[str] = ""
    """Of the open simulation."""

    _ending: ClassVar["weakref.finalize[Any, Any] | None"] = None
    """Ends the open simulation, when asked to or when nothing refers to it any more."""

    def __init__(
        self,
        network: Path,
        routes: Path,
        program: Path,
        *,
        step: float,
        seed: int,
        window: bool,
        owner: str = "a simulation",
    ) -> None:
        self.owner = owner
        self._steered: set[str] = set()
        self._step = step
        self._api, self._window = _api(window), window
        options = {"-n": str(network), "-r": str(routes), "-a": str(program)}
        options |= {"--step-length": f"{step:g}", "--seed": str(tools.sumo_seed(seed)), **FLAGS}
        if window:
            options |= {"--start": "true", "--quit-on-end": "true", "--delay": "100"}
        self._command = [
            str(tools.program_path("sumo-gui" if window else "sumo")),
            *[part for option in options.items() for part in option],
        ]

    def __enter__(self) -> Self:
        _refuse_a_second()
        self._folder = tempfile.TemporaryDirectory(prefix="rightofway-")
        self._trips = Path(self._folder.name) / "trips.xml"
        os.environ["SUMO_HOME"] = tools.sumo_environment()["SUMO_HOME"]
        try:
            self._api.start([*self._command, "--tripinfo-output", str(self._trips)])
        except Exception as error:  # libsumo raises its own and the traci kinds
            self._folder.cleanup()
            raise NetworkError(f"SUMO does not start: {error}") from error
        weakref.finalize(self, self._folder.cleanup)
        self._end = Simulation._ending = weakref.finalize(self, self._api.close)
        Simulation._owner = self.owner
        return self

    def __exit__(self, *error: object) -> None:
        self._end()
        self._folder.cleanup()
        if self._window and isinstance(error, self._api.FatalTraCIError):
            raise UsageError("the window was closed before the episode ended") from error

    def step(self) -> float:
        """Simulate one step.

        Returns:
            The time now [s].
        """
        self._api.simulationStep()
        return float(self._api.simulation.getTime())

    def body(self, vehicle: str) -> Body:
        """What a vehicle's class can do."""
        api = self._api.vehicle
        return Body(
            vehicle_class=api.getTypeID(vehicle),
            length=api.getLength(vehicle),
            acceleration=api.getAccel(vehicle),
            deceleration=api.getDecel(vehicle),
            maximum_speed=api.getMaxSpeed(vehicle),
        )

    def paint(self, vehicle: str, is_robot: bool) -> None:
        """Show RVs red and HVs white, as the paper's figures do; without a window nothing."""
        if self._window:
            self._api.vehicle.setColor(vehicle, (230, 40, 30) if is_robot else (255, 255, 255))

    def in_zone(self, junction: Junction) -> list[Reading]:
        """The vehicles in a junction's control zone with their distance to the entrance."""
        ids = self._api.lane.getLastStepVehicleIDs
        position, speed = self._api.vehicle.getLanePosition, self._api.vehicle.getSpeed
        reach = junction.intersection.control_zone
        readings = []
        for lane, place in junction.zone.items():
            start = place.end + place.length
            for vehicle in ids(lane):
                distance = start - position(vehicle)
                if distance <= reach:
                    readings.append((vehicle, lane, distance, speed(vehicle)))
        return readings

    def inside(self, junction: Junction) -> list[Reading]:
        """The vehicles inside a junction with their position on their lane."""
        ids = self._api.lane.getLastStepVehicleIDs
        position, speed = self._api.vehicle.getLanePosition, self._api.vehicle.getSpeed
        return [
            (vehicle, lane, position(vehicle), speed(vehicle))
            for lane in junction.inside
            for vehicle in ids(lane)
        ]

    def poses(self) -> list[Pose]:
        """Where every vehicle on the road is."""
        api = self._api.vehicle
        poses = []
        for name in api.getIDList():
            x, y = api.getPosition(name)
            poses.append(Pose(name, x, y, api.getAngle(name), api.getSpeed(name)))
        return poses

    def size(self, vehicle: str) -> Size:
        """How large a vehicle is."""
        return Size(self._api.vehicle.getLength(vehicle), self._api.vehicle.getWidth(vehicle))

    def lights(self, light: str) -> str:
        """The state that a traffic light shows, a letter per link."""
        return str(self._api.trafficlight.getRedYellowGreenState(light))

    def colliding(self) -> list[tuple[str, str]]:
        """Pairs of vehicles that collide now, each pair sorted; a pair repeats while it lasts."""
        return [
            (min(crash.collider, crash.victim), max(crash.collider, crash.victim))
            for crash in self._api.simulation.getCollisions()
        ]

    def emergency_brakings(self) -> int:
        """Emergency brakings since the start."""
        return int(self._api.simulation.getParameter("", "stats.safety.emergencyBraking"))

    def set_speed(self, vehicle: str, speed: float) -> None:
        """Ask a vehicle for a speed in the next step [m/s]; SUMO's safety checks stay on."""
        if vehicle not in self._steered:
            self._api.vehicle.setSpeedMode(vehicle, CHECKED)
            self._steered.add(vehicle)
        self._api.vehicle.setSpeed(vehicle, max(0.0, speed))

    def release(self, vehicle: str) -> None:
        """Let a vehicle drive itself again; one that has arrived is passed over."""
        self._steered.discard(vehicle)
        with contextlib.suppress(self._api.TraCIException):
            self._api.vehicle.setSpeed(vehicle, -1)

    def change_lane(self, vehicle: str, index: int) -> None:
        """Ask a vehicle to take a lane of its edge, 0 at the kerb, within the next step."""
        self._api.vehicle.changeLane(vehicle, index, self._step)

    def set_lights(self, light: str, state: str) -> None:
        """Show a state on a traffic light, a letter per link."""
        self._api.trafficlight.setRedYellowGreenState(light, state)

    def finish(self) -> list[Trip]:
        """End the run and read what SUMO reports of every vehicle."""
        self._end()
        return list(_trips(self._trips))


def _refuse_a_second() -> None:
    """Let dropped simulations end, then see that none is open.

    Raises:
        UsageError: one is.
    """
    for let_go in (gc.collect, _clear_tracebacks, gc.collect):
        if Simulation._ending is None or not Simulation._ending.alive:
            return
        let_go()
    if Simulation._ending is not None and Simulation._ending.alive:
        raise UsageError(
            "libsumo holds one simulation per process; close the other first: "
            f"{Simulation._owner} holds it. Call its close(), or drop what still refers to it, "
            "such as an exception that was caught. Simulations side by side need a process each"
        )


def _clear_tracebacks() -> None:
    """Drop what only finished frames refer to, of the exception in hand and the last one shown."""
    for error in (sys.exception(), getattr(sys, "last_value", None)):
        while error is not None:
            traceback.clear_frames(error.__traceback__)
            error = error.__cause__ or error.__context__


def _api(window: bool) -> Any:
    """Libsumo in process; traci, which has the same functions, for a window."""
    if window:
        import traci

        return traci
    import libsumo

    return libsumo


def _trips(path: Path) -> Iterator[Trip]:
    for _, element in ElementTree.iterparse(path):  # noqa: S314  (SUMO's output)
        if element.tag != "tripinfo":
            continue
        value = {key: float(element.get(key, "0")) for key in _NUMBERS}
        emissions = element.find("emissions")
        yield Trip(
            id=element.attrib["id"],
            depart=value["depart"] if value["depart"] >= 0 else None,
            arrival=value["arrival"] if value["arrival"] >= 0 else None,
            insertion_delay=value["departDelay"],
            duration=value["duration"],
            time_loss=value["timeLoss"],
            distance=value["routeLength"],
            emissions=None
            if emissions is None
            else Emissions(
                co2=float(emissions.attrib["CO2_abs"]) / 1000,
                nox=float(emissions.attrib["NOx_abs"]),
                fuel=float(emissions.attrib["fuel_abs"]) / 1000,
            ),
            meddled=element.get("vaporized", "") not in ("", "end") or value["stopTime"] > 0,
        )
        element.clear()


_NUMBERS = ("depart", "arrival", "departDelay", "duration", "timeLoss", "routeLength", "stopTime")
