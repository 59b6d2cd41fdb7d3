# The public names: to write a controller, and to run it. Each is imported when it is first used.
from .admission.conformance import conformance_cases as conformance_cases
from .control.controller import Command as Command
from .control.controller import Controller as Controller
from .control.controller import Drive as Drive
from .control.controller import Go as Go
from .control.controller import Phase as Phase
from .control.controller import Stop as Stop
from .control.intersection import Intersection as Intersection
from .control.intersection import Lane as Lane
from .control.intersection import Movement as Movement
from .control.intersection import Way as Way
from .control.state import Body as Body
from .control.state import Crossing as Crossing
from .control.state import MovementState as MovementState
from .control.state import TrafficState as TrafficState
from .control.state import Vehicle as Vehicle
from .control.training import Training as Training
from .plumbing.errors import RightOfWayError as RightOfWayError
from .records.record import Record as Record
from .scenario.catalogue import find_scenario as find_scenario
from .scenario.scenario import Scenario as Scenario
from .scenario.signal import Signal as Signal
from .scenario.signal import SignalPhase as SignalPhase
from .study.episode import Episode as Episode
from .study.run import run as run
from .study.study import Study as Study
from .study.study import run_study as run_study

__version__: str
