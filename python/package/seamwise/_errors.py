"""Exceptions, by whose fault they are."""

from __future__ import annotations


class Error(Exception):
    """An error of Seamwise.

    ``path`` is the file that it is about and ``place`` the place in it, such as a JSON pointer or a line;
    each is None where there is none.
    """

    def __init__(self, message: str, path: str | None = None, place: str | None = None) -> None:
        super().__init__(message)
        self.path = path
        self.place = place

    def __reduce__(self) -> tuple[type[Error], tuple[str, str | None, str | None]]:
        return type(self), (str(self), self.path, self.place)


class FileError(Error, OSError):
    """A file can't be read or written."""

    # OSError makes its text of the arguments that it is given.
    def __str__(self) -> str:
        return str(self.args[0])


class InvalidError(Error, ValueError):
    """A file or an array is wrong."""


class UnsupportedError(Error):
    """A file is valid but asks for something that this version can't do."""


class TimeLimitError(Error, TimeoutError):
    """The work took longer than it was allowed to."""

    def __str__(self) -> str:
        return str(self.args[0])


class CanceledError(Error):
    """The work was ended by whoever watched its progress."""


class OptionsError(Error, ValueError):
    """An argument makes no sense."""


class InternalError(Error, RuntimeError):
    """A mistake in Seamwise: please report it."""
