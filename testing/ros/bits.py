"""Messages to compare."""


def bits(message):
    """Return all that a message says: NaN is equal to itself, and padding is left out."""
    return repr(message)
