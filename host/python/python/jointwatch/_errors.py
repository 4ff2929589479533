"""Exceptions: one sentence each, as the command line prints it."""


class Error(Exception):
    """Whatever can go wrong: what, where, and what to try."""


class DataError(Error, ValueError):
    """Bad data: a study, a log, an array or a model that does not hold what it should (exit code 3)."""


class UsageError(Error, ValueError):
    """Wrong use (exit code 2)."""


class FailedError(Error, RuntimeError):
    """Could not be done: a file that cannot be written, say (exit code 1)."""
