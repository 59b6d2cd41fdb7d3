"""The one tree of errors that a user can cause; the command line catches its root once."""


class RightOfWayError(Exception):
    """Root of all errors with a message for the user.

    The message names the offender, says what was expected and what to do.
    """


class ScenarioError(RightOfWayError):
    """A scenario file cannot be read, or says something impossible."""


class SuiteError(RightOfWayError):
    """A suite file cannot be read, or says something impossible."""


class NetworkError(RightOfWayError):
    """A SUMO program refused the network, the demand or the signal program."""


class ControllerError(RightOfWayError):
    """A controller cannot be found, or broke the contract."""


class StoreError(RightOfWayError):
    """Records cannot be written or read."""


class ActionLogError(RightOfWayError):
    """An action log cannot be read, or tells of something else."""


class BundleError(RightOfWayError):
    """A submission cannot be made, or is not fit to be looked at."""


class ClusterError(RightOfWayError):
    """A cluster cannot be reached, or its workers cannot run what is asked."""


class TrajectoryError(RightOfWayError):
    """Trajectories cannot be read, or not be shown together."""


class UsageError(RightOfWayError):
    """The command was called with something that makes no sense."""
