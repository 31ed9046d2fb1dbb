"""Messages to compare: a NaN in them is equal to itself; what fills gaps in bytes is not seen."""


def bits(message):
    return repr(message)
