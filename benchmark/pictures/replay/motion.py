"""Where vehicles are between two steps; ``page/motion.js`` beside does the same in pages.

A cubic curve through the places of each step whose speeds are the harmonic means of those before
and after, so that no vehicle overshoots, and one that stands stays where it is. SUMO changes lanes
within a step; on the way a vehicle turns aside and back.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmark.pictures.replay.trajectories import Floats, Ints, Trajectories

STANDS = 0.05  # m in a step, below which nobody moves
SIDEWAYS = 1.0  # m to the side in a step, from which it is a change of lanes
LEAN = 0.35  # rad, the most that a vehicle turns aside while it changes lanes
SLOWEST = 3.0  # m ahead in a step that a change of lanes is taken to need, for its angle

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Poses:
    """Where everybody on the road is at a moment; the arrays have an entry per vehicle."""

    vehicle: Ints
    entry: Ints  # in the tracks, of the step before the moment
    place: Floats  # (n, 2), m, of the middle of the front bumper
    heading: Floats  # rad clockwise from north


@dataclass(frozen=True)
class Motion:
    """Trajectories with what is needed between their steps; arrays as those of the tracks."""

    kept: Trajectories
    place: Floats  # (n, 2), m
    tangent: Floats  # (n, 2), m in a step
    turn: Floats  # degrees in a step
    lean: Floats  # rad to the right, until the next entry

    @classmethod
    def of(cls, kept: Trajectories) -> "Motion":
        """The motion of an episode."""
        tracks, offsets = kept.tracks, kept.offsets
        place = np.column_stack([tracks.x, tracks.y])
        first, last = np.zeros((2, len(place)), dtype=bool)
        first[offsets[:-1]] = last[offsets[1:] - 1] = True
        out, turning = _to_next(place, last), _to_next(tracks.angle, last)
        into, turned = np.roll(out, 1, axis=0), np.roll(turning, 1)
        lean = _leaning(tracks.angle + turning / 2, out)
        tangent = _tangents(into, out, (lean != 0) | (np.roll(lean, 1) != 0), tracks.angle)
        tangent[first], tangent[last & ~first] = out[first], into[last & ~first]
        turn = np.where(first, turning, np.where(last, turned, _harmonic(turned, turning)))
        return cls(kept, place, tangent, turn, lean)

    def at(self, step: float) -> Poses:
        """Everybody on the road at a moment, in steps from the first."""
        kept, whole = self.kept, int(step)
        share = step - whole
        into = whole - np.asarray(kept.vehicles.first, dtype=np.int64)
        last = np.asarray(kept.vehicles.steps, dtype=np.int64) - (1 if share == 0 else 2)
        vehicle = np.flatnonzero((into >= 0) & (into <= last)).astype(np.int64)
        entry = kept.offsets[vehicle] + into[vehicle]
        after = entry if share == 0 else entry + 1
        rest = 1 - share
        start, out = rest * rest * (1 + 2 * share), rest * rest * share
        end, arrive = share * share * (3 - 2 * share), -share * share * rest

        def between(value: Floats, slope: Floats) -> Floats:
            places: Floats = start * value[entry] + end * value[after]
            places += out * slope[entry] + arrive * slope[after]
            return places

        heading = np.radians(between(kept.tracks.angle, self.turn))
        heading += self.lean[entry] * np.sin(np.pi * share) ** 2
        return Poses(vehicle, entry, between(self.place, self.tangent), heading)


def _to_next(values: Floats, last: Flags) -> Floats:
    """Differences to the next entry; 0 at a vehicle's last."""
    differences: Floats = np.roll(values, -1, axis=0) - values
    differences[last] = 0.0
    return differences


def _harmonic(into: Floats, out: Floats) -> Floats:
    """The harmonic mean; 0 where the signs differ, so that nothing goes farther than it may."""
    together = into * out > 0
    return np.divide(2 * into * out, into + out, out=np.zeros_like(into), where=together)


def _leaning(angle: Floats, out: Floats) -> Floats:
    """How far a vehicle turns aside until its next entry, where it changes lanes; else 0."""
    heading = np.radians(angle)
    aside = out[:, 0] * np.cos(heading) - out[:, 1] * np.sin(heading)
    ahead = out[:, 0] * np.sin(heading) + out[:, 1] * np.cos(heading)
    lean = np.clip(np.arctan2(aside, np.maximum(ahead, SLOWEST)), -LEAN, LEAN)
    return np.where(np.abs(aside) < SIDEWAYS, 0.0, lean)


def _tangents(into: Floats, out: Floats, sideways: Flags, angle: Floats) -> Floats:
    """The velocities in the middle of tracks; along the heading where lanes are changed."""
    before, after = np.linalg.norm(into, axis=1), np.linalg.norm(out, axis=1)
    moves = (before >= STANDS) & (after >= STANDS)
    safe = np.where(moves, before, 1.0)[:, None], np.where(moves, after, 1.0)[:, None]
    ahead = into / safe[0] + out / safe[1]
    heading = np.radians(angle)
    along = np.column_stack([np.sin(heading), np.cos(heading)])
    ahead = np.where(sideways[:, None], along, ahead)
    length = np.linalg.norm(ahead, axis=1)
    moves &= length > 1e-6
    speed = np.where(moves, _harmonic(before, after), 0.0)
    tangent: Floats = ahead / np.maximum(length, 1e-6)[:, None] * speed[:, None]
    return tangent
