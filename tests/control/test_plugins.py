"""Controllers that are installed, and their options."""

import pytest
from factories.scenarios import smoke

from baselines.virtual_signal import VirtualSignal
from benchmark.control import plugins
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes


class Several(VirtualSignal):
    """Takes options of several types."""

    def __init__(self, count: int = 1, *, share: float = 0.5, loud: bool = False) -> None:
        self.given = (count, share, loud)


@pytest.fixture
def several(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugins, "load_class", lambda name: Several)


def test_a_name_alone_has_no_options() -> None:
    found = plugins.find_controller("virtual-signal")
    assert (found.reference, found.kind, dict(found.options)) == (
        *("virtual-signal", VirtualSignal, {}),
    )


@pytest.mark.parametrize(
    ("reference", "given", "canonical"),
    [
        ("it?count=3", (3, 0.5, False), "it?count=3"),
        ("it?share=0.50&count=3", (3, 0.5, False), "it?count=3&share=0.5"),
        ("it?share=2.0&loud=yes", (1, 2.0, True), "it?loud=true&share=2"),
        ("it?loud=False", (1, 0.5, False), "it?loud=false"),
        ("it?", (1, 0.5, False), "it"),
        ("it?share=1e+0", (1, 1.0, False), "it?share=1"),
    ],
)
def test_options_reach_the_constructor_and_have_one_spelling(
    several: None, reference: str, given: tuple[object, ...], canonical: str
) -> None:
    found = plugins.find_controller(reference)
    made = found.new()
    assert isinstance(made, Several)
    assert made.given == given
    assert found.reference == canonical
    assert plugins.find_controller(canonical) == found


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("it?cuont=3", 'it?cuont=3": cuont: unknown key "cuont"; did you mean "count"?'),
        ("it?count=3.5", "it?count=3.5\": count: expected a whole number; got '3.5'"),
        ("it?share=half", "it?share=half\": share: expected a number; got 'half'"),
        ("it?loud=maybe", "it?loud=maybe\": loud: expected true or false; got 'maybe'"),
        ("it?count=1&count=2", "an option is given twice"),
        ("it?count", "expected options as in it?first=1&second=2"),
    ],
)
def test_an_option_that_makes_no_sense_is_refused(
    several: None, reference: str, message: str
) -> None:
    with pytest.raises(ControllerError) as caught:
        plugins.find_controller(reference)
    assert message in str(caught.value)


def test_options_change_what_the_controller_does_and_stand_in_its_record() -> None:
    (episode,) = all_episodes([smoke("tee")], ["virtual-signal?clearance=30"], [0.5], [1])
    found = run_episode(episode)
    plain = run_episode(Episode(smoke("tee"), "virtual-signal", 0.5, 1))
    assert (found.controller, found.status) == ("virtual-signal?clearance=30", "ok")
    assert found.controller_from == plain.controller_from
    assert found.junctions != plain.junctions


def test_one_controller_in_two_spellings_is_one() -> None:
    names = ["virtual-signal?green=40&clearance=3", "virtual-signal?clearance=3.0&green=40"]
    assert len(all_episodes([smoke("crossing")], names, [0.5], [1])) == 1


def test_names_that_mean_something_to_pydantic_are_options_like_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Odd(VirtualSignal):
        def __init__(self, schema: int, _private: str = "", model_config: bool = False) -> None:
            self.given = schema, _private, model_config

    monkeypatch.setattr(plugins, "load_class", lambda name: Odd)
    made = plugins.find_controller("it?model_config=yes&schema=3&_private=a%26b")
    assert made.reference == "it?_private=a%26b&model_config=true&schema=3"
    assert vars(made.new())["given"] == (3, "a&b", True)
    with pytest.raises(ControllerError, match=r'^"it": schema: this key is required$'):
        plugins.find_controller("it")
