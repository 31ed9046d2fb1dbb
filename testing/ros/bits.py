"""Comparison of messages: NaN equals NaN, and padding bytes are ignored."""


def bits(message):
    return repr(message)
