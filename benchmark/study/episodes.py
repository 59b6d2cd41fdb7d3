"""Which episodes a study holds: every controller meets the same scenarios, rates and seeds."""

from collections.abc import Callable, Iterable, Sequence

from benchmark.control import plugins
from benchmark.control.declarations import Declaration
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import declaration_of
from benchmark.plumbing.errors import ControllerError, UsageError
from benchmark.scenario import catalogue
from benchmark.scenario.evaluation import MOST_SEEDS
from benchmark.scenario.scenario import Scenario
from benchmark.study.episode import Episode
from benchmark.study.suite import Suite, find_suite, shipped_suites
from benchmark.sumo import demand, network, signals

MOST_EPISODES = 2_000_000  # of one study


def choose_episodes(
    references: Sequence[str],
    controllers: Sequence[str] = (),
    rates: Sequence[float] = (),
    seeds: Sequence[int] = (),
    *,
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
    notice: Callable[[str], None] = lambda message: None,
) -> list[Episode]:
    """The episodes of scenarios, or of one suite.

    Args:
        references: files, folders or shipped names of scenarios; or one suite's, alone.
        controllers: references; none: the suite's, or all that are installed and can be loaded.
        rates: penetration rates; none: the suite's, or each scenario's own.
        seeds: none: the suite's, or each scenario's own.
        isolate: whether controllers run in processes of their own; None: those not installed do.
        limits: of isolated controllers.
        notice: told of installed controllers that cannot be loaded.

    Raises:
        ScenarioError: a reference leads nowhere.
        SuiteError: the suite, or what it names, is not valid.
        ControllerError: a controller is not there, or does not take its options.
        UsageError: a suite does not stand alone.
    """
    if (suite := find_suite(references)) is not None:
        return episodes_of(suite, controllers, rates, seeds, isolate=isolate, limits=limits)
    scenarios = catalogue.find_scenarios(references, also=shipped_suites())
    controllers = controllers or _loadable_controllers(isolate, limits, notice)
    return all_episodes(scenarios, controllers, rates, seeds, isolate=isolate, limits=limits)


def episodes_of(
    suite: Suite,
    controllers: Sequence[str] = (),
    rates: Sequence[float] = (),
    seeds: Sequence[int] = (),
    *,
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
) -> list[Episode]:
    """The episodes of a suite; what is given replaces what it says.

    Raises:
        SuiteError: a scenario or controller that it names is not there.
        ControllerError: one that is given is not.
    """
    return all_episodes(
        suite.load_scenarios(),
        controllers or suite.checked_controllers(isolate, limits),
        rates or suite.rates,
        seeds or range(1, (suite.seeds or 0) + 1),
        isolate=isolate,
        limits=limits,
    )


def all_episodes(
    scenarios: Sequence[Scenario],
    controllers: Sequence[str],
    rates: Sequence[float] | None = None,
    seeds: Sequence[int] | None = None,
    *,
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
) -> list[Episode]:
    """Every controller on every scenario at every rate with every seed, each once.

    A controller that commands no vehicle runs once per scenario and seed, with no rate: what
    happens under it does not depend on who is an RV.

    Args:
        scenarios: what to run on.
        controllers: references, as ``benchmark.control.plugins.find_controller`` reads them.
        rates: penetration rates; none: each scenario's own.
        seeds: none: each scenario's own.
        isolate: whether controllers run in processes of their own; None: those not installed do.
        limits: of isolated controllers.

    Raises:
        ControllerError: a controller is unknown, cannot be imported or has no such option, or two
            files have the same name.
    """
    declarations = [declaration_of(reference, isolate, limits) for reference in controllers]
    _check_labels(declarations)
    each_once = {declaration.reference: declaration for declaration in declarations}
    _check_size(scenarios, list(each_once.values()), rates, seeds)
    return [
        Episode(scenario, declaration.reference, rate, seed, isolate, limits)
        for scenario in scenarios
        for declaration in each_once.values()
        for rate in _rates(rates or scenario.evaluation.penetration_rates, declaration)
        for seed in dict.fromkeys(seeds or range(1, scenario.evaluation.seeds + 1))
    ]


def _check_size(
    scenarios: Sequence[Scenario],
    controllers: Sequence[Declaration],
    rates: Sequence[float] | None,
    seeds: Sequence[int] | None,
) -> None:
    """Refuse a study that nobody can mean, before a list of it fills the memory."""
    if seeds and len(seeds) > MOST_SEEDS:
        raise UsageError(f"--seeds {len(seeds):,}: expected at most {MOST_SEEDS:,}")
    count = sum(
        len([*_rates(rates or scenario.evaluation.penetration_rates, controller)])
        * len(seeds or range(scenario.evaluation.seeds))
        for scenario in scenarios
        for controller in controllers
    )
    if count > MOST_EPISODES:
        raise UsageError(
            f"{count:,} episodes (scenarios times controllers, rates and seeds); expected at most "
            f"{MOST_EPISODES:,}: run them in parts, each with --out of its own"
        )


def _rates(rates: Sequence[float], declaration: Declaration) -> Iterable[float | None]:
    return dict.fromkeys(rates) if declaration.needs_robot_vehicles else (None,)


def _check_labels(declarations: Iterable[Declaration]) -> None:
    """Refuse controllers that records would not tell apart: they name a file without its folder."""
    references: dict[str, str] = {}
    for declaration in declarations:
        label, reference = declaration.label, declaration.reference
        if (other := references.setdefault(label, reference)) != reference:
            raise ControllerError(
                f"{other} and {reference} would both be {label} in records; "
                "rename one file or class"
            )


def build_ahead(episodes: Sequence[Episode]) -> None:
    """Build every network and one demand on it, so that what cannot be built is refused at once.

    The demands of other seeds are built by the workers that need them.

    Raises:
        RightOfWayError: a scenario cannot be built, or its signal endangers.
    """
    one_of_each = {episode.scenario.hash: episode for episode in episodes}.values()
    for scenario in (episode.scenario for episode in one_of_each):
        signals.check_programs(scenario, scenario.programs, network.build_network(scenario))
    for episode in one_of_each:
        demand.build_routes(episode.scenario, network.build_network(episode.scenario), episode.seed)


def _loadable_controllers(
    isolate: bool | None, limits: Limits, notice: Callable[[str], None]
) -> list[str]:
    """All installed controllers but those that cannot be loaded, which are named."""
    loadable = []
    for name in plugins.discovered():
        try:
            declaration_of(name, isolate, limits)
        except ControllerError as error:
            notice(f"{error}; left out")
        else:
            loadable.append(name)
    return loadable
