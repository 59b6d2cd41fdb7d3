"""Whole numbers as bytes: seven bits in each, the sign lowest (zigzag), as Protocol Buffers."""

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]


def encode(values: Ints) -> bytes:
    """Whole numbers in as few bytes as each needs, the lowest seven bits first."""
    rest = (values.astype(np.int64) << 1 ^ values.astype(np.int64) >> 63).astype(np.uint64)
    septets = []
    while True:
        septets.append(rest & np.uint64(127))
        rest = rest >> np.uint64(7)
        if not rest.any():
            break
    table = np.array(septets, dtype=np.uint8).reshape(len(septets), -1)
    length = len(septets) - np.argmax(table[::-1] > 0, axis=0)
    length[~table.any(axis=0)] = 1
    place = np.arange(len(septets))[:, None]
    table[place < length - 1] |= 128
    return bytes(table.T[(place < length).T])


def decode(data: bytes) -> Ints:
    """What ``encode`` wrote.

    Raises:
        ValueError: the last number is cut off, or one is too long.
    """
    found = np.frombuffer(data, dtype=np.uint8)
    ends = np.flatnonzero(found < 128)
    if not len(found):
        return np.zeros(0, dtype=np.int64)
    if not len(ends) or ends[-1] != len(found) - 1:
        raise ValueError("the last number is cut off")
    starts = np.concatenate([[0], ends[:-1] + 1])
    place = np.arange(len(found)) - np.repeat(starts, ends - starts + 1)
    if place.max() > 8:
        raise ValueError("a number is too long")
    septets = (found & 127).astype(np.uint64) << (7 * place).astype(np.uint64)
    zigzag = np.add.reduceat(septets, starts)
    return (zigzag >> np.uint64(1)).astype(np.int64) ^ -(zigzag & np.uint64(1)).astype(np.int64)
