"""Text from elsewhere as a terminal and a table may show it."""

import unicodedata
from functools import cache

STEERING = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})  # categories of Unicode
UNSEEN = r"[\p{Cc}\p{Cf}\p{Zl}\p{Zp}]"
"""What ``shown`` changes, as a regular expression of Rust."""


def shown(text: str, keep: str = "") -> str:
    r"""Text with control characters, and all else that no eye can see, written as escapes.

    What steers a terminal, turns the direction of writing or joins letters invisibly is seen and
    has no effect, as in ``\x1b[2J``.

    Args:
        text: from elsewhere.
        keep: control characters that stay, such as a newline.
    """
    if text.isprintable():
        return text
    return "".join(sign if sign in keep else _visible(sign) for sign in text)


@cache
def _visible(sign: str) -> str:
    if unicodedata.category(sign) not in STEERING:
        return sign
    return sign.encode("unicode_escape").decode()
