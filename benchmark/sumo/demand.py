"""Turning counts -> routes by jtrrouter; vehicle classes; who is an RV.

Everything random is drawn here, from (seed, vehicle id), before any controller is met: the same
seed gives the same departures, routes and drivers to every controller at every rate.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from statistics import NormalDist
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from benchmark.scenario.demand import TurnCounts
from benchmark.scenario.layout import TURNS
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.vehicles import Krauss, VehicleClass
from benchmark.sumo import tools
from benchmark.sumo.layout_xml import exit_name
from benchmark.sumo.network import Network

OPTIONS = ("--accept-all-destinations", "true")
FOREVER = 1000000.0  # s


@dataclass(frozen=True, slots=True)
class Traveller:
    """One vehicle of the demand."""

    id: str
    vehicle_class: str
    depart: float  # s, when it wants to enter
    route: tuple[str, ...]  # edge ids


@dataclass(frozen=True)
class Routes:
    """The demand of one seed as a SUMO route file, and what it holds."""

    path: Path
    hash: str  # SHA-256 of the file
    travellers: Mapping[str, Traveller]
    warnings: str  # what jtrrouter had to say


def build_routes(scenario: Scenario, network: Network, seed: int) -> Routes:
    """The routes of a scenario and seed, from the cache where they were built before.

    Raises:
        NetworkError: jtrrouter refuses the demand.
    """
    flows, turns = flows_xml(scenario), turns_xml(scenario)
    classes = "".join(
        vehicle_type_xml(name, vehicle, scenario.intersection.speed_cap)
        for name, vehicle in scenario.vehicles.items()
    )
    drivers = repr({name: vehicle.model_dump() for name, vehicle in scenario.vehicles.items()})
    drivers += repr([scenario.class_shares(name) for name in scenario.approaches.names()])
    made_of = [network.hash, flows, turns, classes, drivers, str(seed), *OPTIONS]
    key = tools.digest(tools.sumo_version(), *made_of, Path(__file__).read_bytes())

    def make(folder: Path) -> None:
        (folder / "flows.xml").write_text(flows)
        (folder / "turns.xml").write_text(turns)
        drawn = folder / "drawn.rou.xml"
        files = ["-n", network.path, "--route-files", folder / "flows.xml"]
        files += ["-t", folder / "turns.xml", "-o", drawn]
        drawn_by = str(tools.sumo_seed(seed))
        warnings = tools.run_program("jtrrouter", *map(str, files), "--seed", drawn_by, *OPTIONS)
        (folder / "warnings.txt").write_text(warnings)
        (folder / "routes.rou.xml").write_text(_with_drivers(drawn, scenario, classes, seed))

    folder = tools.cached("routes", key, make)
    path = folder / "routes.rou.xml"
    return Routes(
        path=path,
        hash=tools.digest(path.read_bytes()),
        travellers=_read(path),
        warnings=(folder / "warnings.txt").read_text(),
    )


def unit_draw(purpose: str, seed: int, vehicle: str) -> float:
    """A number in [0, 1) that depends on nothing but the purpose, the seed and the vehicle."""
    data = hashlib.blake2b(f"{purpose}/{seed}/{vehicle}".encode(), digest_size=8).digest()
    return int.from_bytes(data, "big") / 2**64


def is_robot(seed: int, vehicle: str, rate: float) -> bool:
    """Whether a vehicle is an RV; a higher rate only adds RVs."""
    return unit_draw("robot", seed, vehicle) < rate


def flows_xml(scenario: Scenario) -> str:
    """Poisson arrivals per approach and period; jtrrouter wants them by time of begin."""
    lines = []
    for number, period in enumerate(scenario.demand):
        for name, approach in scenario.approaches.items():
            hourly = period.counts(name).total
            if hourly > 0:
                entry = f"{name}.upstream" if approach.has_bay else name
                lines.append(
                    f'<flow id="{name}.{number}" from="{entry}" begin="{period.begin:g}" '
                    f'end="{period.end:g}" period="exp({hourly / 3600:.8f})" '
                    'departLane="best" departSpeed="max"/>'
                )
    return "\n".join(["<routes>", *lines, "</routes>", ""])


def turns_xml(scenario: Scenario) -> str:
    """Turn shares per approach, for jtrrouter.

    jtrrouter asks for them when a vehicle reaches the intersection, and where it finds none it
    invents some. So a period's shares hold until the next period begins, and an approach that the
    next period does not count keeps the ones it had.
    """
    lines = ["<edgeRelations>"]
    counted: dict[str, TurnCounts] = {}
    for period, after in zip_longest(scenario.demand, scenario.demand[1:]):
        end = after.begin if after else FOREVER
        lines.append(f'<interval begin="{period.begin:g}" end="{end:g}">')
        for name in scenario.approaches.names():
            if period.counts(name).total > 0:
                counted[name] = period.counts(name)
            for turn in TURNS:
                count = counted[name].of(turn) if name in counted else 0.0
                if count > 0 and (leg := scenario.approaches.exit_leg(name, turn)):
                    lines.append(
                        f'<edgeRelation from="{name}" to="{exit_name(leg)}" count="{count:g}"/>'
                    )
        lines.append("</interval>")
    return "\n".join([*lines, "</edgeRelations>", ""])


def vehicle_type_xml(name: str, vehicle: VehicleClass, speed_cap: float | None) -> str:
    """A SUMO vehicle type for a class; drivers differ by the speed factor of each vehicle."""
    driver = vehicle.car_following
    attributes: dict[str, Any] = {
        "id": name,
        "vClass": vehicle.kind,
        "carFollowModel": driver.model,
        "accel": driver.acceleration,
        "decel": driver.deceleration,
        "tau": driver.headway,
        "minGap": driver.minimum_gap,
        "length": vehicle.length,
        "maxSpeed": speed_cap,
        "sigma": driver.imperfection if isinstance(driver, Krauss) else None,
    }
    return "<vType {}/>\n".format(
        " ".join(f"{k}={quoteattr(str(v))}" for k, v in attributes.items() if v is not None)
    )


def _with_drivers(drawn: Path, scenario: Scenario, classes: str, seed: int) -> str:
    """Jtrrouter's routes with a class and a speed factor for each vehicle."""
    lines = ["<routes>", classes.rstrip()]
    for vehicle in ElementTree.parse(drawn).getroot().iter("vehicle"):  # noqa: S314 (our own file)
        name = vehicle.attrib["id"]
        period = scenario.demand[int(name.split(".")[1])]
        if float(vehicle.attrib["depart"]) >= period.end:
            continue  # jtrrouter lets every flow end with a vehicle past its end
        kind = _draw_class(scenario, seed, name)
        deviation = scenario.vehicles[kind].speed_deviation
        route = vehicle.find("route")
        assert route is not None
        lines.append(
            f'<vehicle id="{name}" type="{kind}" depart="{vehicle.attrib["depart"]}" '
            f'departLane="best" departSpeed="max" '
            f'speedFactor="{_speed_factor(deviation, seed, name):.4f}">'
            f'<route edges="{route.attrib["edges"]}"/></vehicle>'
        )
    return "\n".join([*lines, "</routes>", ""])


def _draw_class(scenario: Scenario, seed: int, vehicle: str) -> str:
    """A vehicle's class, drawn by the classes' shares on its approach."""
    point, total = unit_draw("class", seed, vehicle), 0.0
    for name, share in scenario.class_shares(vehicle.partition(".")[0]).items():
        total += share
        if point < total:
            return name
    return name


def _speed_factor(deviation: float, seed: int, vehicle: str) -> float:
    """Desired speed over speed limit: normal around 1, cut at two deviations as SUMO's default."""
    if deviation == 0:
        return 1.0
    point = unit_draw("speed", seed, vehicle)
    low, high = NormalDist().cdf(-2), NormalDist().cdf(2)
    return 1.0 + deviation * NormalDist().inv_cdf(low + point * (high - low))


def _read(path: Path) -> dict[str, Traveller]:
    travellers = {}
    for vehicle in ElementTree.parse(path).getroot().iter("vehicle"):  # noqa: S314 (our own file)
        route = vehicle.find("route")
        assert route is not None
        travellers[vehicle.attrib["id"]] = Traveller(
            id=vehicle.attrib["id"],
            vehicle_class=vehicle.attrib["type"],
            depart=float(vehicle.attrib["depart"]),
            route=tuple(route.attrib["edges"].split()),
        )
    return travellers
