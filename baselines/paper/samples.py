"""Records -> the samples of the paper's cells: a controller at an intersection and a rate."""

from collections.abc import Collection, Iterable

from baselines.paper.published import FOLDER, INTERSECTIONS, Place
from benchmark.records.record import Record
from benchmark.records.samples import BySeed, Floats, Sample, cells_of, records_in
from benchmark.records.statistics import Estimate, estimates
from benchmark.records.table import records_table
from benchmark.reports.plots.data import Data, Wish


def canonical(reference: str) -> str:
    """A controller's reference as records have it: options sorted by name."""
    name, mark, query = reference.partition("?")
    return name + mark + "&".join(sorted(query.split("&")))


class Samples:
    """The samples at the paper's intersections.

    Where records of several versions of a scenario lie side by side, those of the last one count.

    Args:
        records: of any scenarios, oldest first.
    """

    def __init__(self, records: Iterable[Record]) -> None:
        from polars import col

        names = {f"{FOLDER}/{intersection}": intersection for intersection in INTERSECTIONS}
        self._records = [record for record in records if record.scenario in names]
        last_version = col("scenario_hash").last().over("scenario")
        table = records_table(self._records)
        self._table = table.filter(col("scenario_hash") == last_version)
        self._samples: dict[tuple[str, str, float | None], Sample] = {}
        for sample in (cell.sample for cell in cells_of(self._table)):
            group = sample.group
            self._samples[group.controller, names[group.scenario], group.rate] = sample

    @property
    def controllers(self) -> list[str]:
        """All that have records, sorted."""
        return sorted({controller for controller, _, _ in self._samples})

    def sample(self, controller: str, place: Place) -> Sample | None:
        """The sample of a cell; without a rate it stands at every rate."""
        intersection, rate = place
        samples = (self._samples.get((controller, intersection, ran)) for ran in (rate, None))
        return next((sample for sample in samples if sample), None)

    def seeds(self, controller: str, place: Place) -> list[int]:
        """The seeds of episodes that ran to their end, sorted."""
        sample = self.sample(controller, place)
        return sample.seeds.tolist() if sample else []

    def values(self, key: str, controller: str, place: Place) -> BySeed:
        """A measure by seed, where the episode has it."""
        sample = self.sample(controller, place)
        return sample.by_seed(key) if sample else {}

    def estimate(self, key: str, controller: str, place: Place) -> Estimate | None:
        """The mean over seeds with its interval; None without records."""
        values = self.values(key, controller, place)
        return estimates([[*values.values()]])[0] if values else None

    def paired(self, key: str, pair: tuple[str, str], place: Place) -> tuple[Floats, Floats] | None:
        """A measure of two controllers on the seeds that both have."""
        ours, baseline = (self.sample(name, place) for name in pair)
        return ours.paired(baseline, key) if ours and baseline else None

    def data(self, controllers: Collection[str], wish: Wish) -> Data:
        """What figures of some controllers are drawn from.

        Raises:
            UsageError: there is nothing of what is wished for.
        """
        from polars import col

        table = self._table.filter(col("controller").is_in(controllers))

        def read(scenarios: Collection[str]) -> list[Record]:
            return records_in(table.filter(col("scenario").is_in(scenarios)), self._records)

        return Data(table, read, wish)
