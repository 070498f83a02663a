"""Ways to damage a file: bytes, lengths, blocks, numbers, words."""

from collections.abc import Callable
from typing import Final

import numpy as np

Generator = np.random.Generator

_NUMBERS: Final = (0, 1, 0x7F, 0x80, 0xFF, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1)
_WORDS: Final = (
    *b'nan inf -1e308 true [deg] 1e999 , "'.split(),
    b"",
    b"\n",
    b"\x00",
)


def cut(content: bytes, random: Generator) -> bytes:
    """The end is missing."""
    return content[: int(random.integers(0, len(content)))]


def flipped(content: bytes, random: Generator) -> bytes:
    """Some bits are wrong, near the beginning, near the end, or anywhere."""
    changed = bytearray(content)
    low, high = _place(len(content), random)
    for place in random.integers(low, high, int(random.integers(1, 9))):
        changed[place] ^= 1 << int(random.integers(0, 8))
    return bytes(changed)


def lengthened(content: bytes, random: Generator) -> bytes:
    """A number that may be a length, a type or an offset is another."""
    size = int(random.choice([1, 2, 4, 8]))
    value = int(_NUMBERS[int(random.integers(len(_NUMBERS)))]) % 256**size
    low, high = _place(len(content), random)
    at = int(random.integers(low, max(low + 1, high - size)))
    order = "little" if random.random() < 0.8 else "big"
    return content[:at] + value.to_bytes(size, order) + content[at + size :]


def moved(content: bytes, random: Generator) -> bytes:
    """A block is lost, there twice, zero, or from elsewhere."""
    size = int(random.integers(1, max(2, len(content) // 8)))
    at, other = (int(random.integers(0, max(1, len(content) - size))) for _ in range(2))
    block = content[other : other + size]
    return {
        0: content[:at] + content[at + size :],
        1: content[:at] + block + content[at:],
        2: content[:at] + bytes(size) + content[at + size :],
        3: content[:at] + block + content[at + size :],
    }[int(random.integers(4))]


def worded(content: bytes, random: Generator) -> bytes:
    """A word of a text is another."""
    at = int(random.integers(0, len(content)))
    word = _WORDS[int(random.integers(len(_WORDS)))]
    return content[:at] + word + content[at + int(random.integers(0, 8)) :]


def _place(size: int, random: Generator) -> tuple[int, int]:
    """The head, the tail or all of a file."""
    part = int(random.integers(3))
    near = min(size, 512)
    return ((0, near), (size - near, size), (0, size))[part]


MUTATIONS: Final[tuple[Callable[[bytes, Generator], bytes], ...]] = (
    cut,
    flipped,
    lengthened,
    moved,
    worded,
)
