"""What libraries say of values, in the words that this product uses."""

import re

_OURS = (
    (r"Input should be a valid number(?:, unable to .*)?", "expected a number"),
    (r"Input should be a valid integer(?:, .*)?", "expected a whole number"),
    (r"Input should be a valid boolean(?:, .*)?", "expected true or false"),
    (r"Input should be a finite number", "expected a finite number"),
    (r"Input should be less than or equal to (\S+)", r"expected at most \1"),
    (r"Input should be greater than or equal to (\S+)", r"expected at least \1"),
    (r"Input should be less than (\S+)", r"expected less than \1"),
    (r"Input should be greater than (\S+)", r"expected more than \1"),
    (r"Input should be (?:a valid )?", "expected "),
)


def in_our_words(message: str) -> str:
    """A message of pydantic's, as our own messages say it; any other as it is."""
    for theirs, ours in _OURS:
        if re.search(theirs, message):
            return re.sub(theirs, ours, message, count=1)
    return message
