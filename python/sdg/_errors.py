"""Exceptions. Most messages give the expected and the found value, like the messages of the program."""


class SdgError(Exception):
    """Base of all exceptions of this package."""


class ArgumentError(SdgError, ValueError):
    """A value that a function does not accept."""


class FileError(SdgError, OSError):
    """A file that does not exist, or that the system cannot read or write."""


class ModelFileError(SdgError, ValueError):
    """A file that is not a grasp model, is damaged, or has another version."""


class PictureError(SdgError, ValueError):
    """An invalid picture or array: type, shape, size, channels."""


class CameraError(SdgError, ValueError):
    """An invalid camera file, a camera without a pose, or a model without lengths."""


class RegionError(SdgError, ValueError):
    """A region that cannot be searched."""


class TeachingError(SdgError, ValueError):
    """A photo or marks unsuitable for teaching, or labels that cannot be used for an evaluation."""


class NothingToGrasp(SdgError, LookupError):
    """No part was found in a picture, but one was requested."""


class ClosedError(SdgError, RuntimeError):
    """A tracker that was closed."""


class ForkedError(SdgError, RuntimeError):
    """A process that was forked from one that had loaded a model, detected or taught."""


class VersionError(SdgError, ImportError):
    """The package's Python files and its native part have different versions."""
