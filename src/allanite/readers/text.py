NAME = "x"
OPTIONS = frozenset()


def sniff(h, p):
    return False
