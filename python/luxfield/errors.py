"""What can go wrong. Messages are one sentence: what failed, with which value, and what to do about it."""


class Error(Exception):
    """Base of all errors that luxfield raises on purpose."""


class InputError(Error, ValueError):
    """The input or the arguments are wrong."""


class DeviceError(Error, RuntimeError):
    """Hardware, storage or a compute device failed."""


class Interrupted(Error):
    """Stopped on request; a capture goes on with `resume=True`."""


class InternalError(Error):
    """A mistake in luxfield itself."""


class LuxfieldWarning(UserWarning):
    """What a person should know although it stops nothing."""
