"""Exceptions. Each text says what was expected and what was found, as the program's own messages do."""


class SdgError(Exception):
    """Base of all exceptions of this package."""


class ArgumentError(SdgError, ValueError):
    """A value that a function does not take."""


class FileError(SdgError, OSError):
    """A file that is not there, or that the system does not read or write."""


class ModelFileError(SdgError, ValueError):
    """A file that is no grasp model, a damaged one, or one of another version."""


class PictureError(SdgError, ValueError):
    """A picture or an array that cannot be looked at: type, shape, size, channels."""


class CameraError(SdgError, ValueError):
    """A camera's file, a camera without its place, a model that knows no lengths."""


class RegionError(SdgError, ValueError):
    """A region that cannot be searched."""


class TeachingError(SdgError, ValueError):
    """A photo and marks that nothing can be taught from, and labels that nothing can be counted on."""


class NothingToGrasp(SdgError, LookupError):
    """No part was found in a picture, where one was asked for."""


class ClosedError(SdgError, RuntimeError):
    """A tracker that was closed."""


class ForkedError(SdgError, RuntimeError):
    """A process that was forked from one that had detected or taught."""


class VersionError(SdgError, ImportError):
    """The package's Python files and its native part are of two versions."""
