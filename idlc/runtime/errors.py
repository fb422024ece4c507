"""The exceptions of messages, and of importing those of other packages."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class DecodeError(ValueError):
    """Bytes that are not a message of the expected type.

    `path` names the field that could not be read, `offset` the byte at which it should begin,
    counted from the start of the buffer.
    """

    def __init__(self, problem: str, path: str = "", offset: int = 0) -> None:
        super().__init__(problem, path, offset)
        self.problem = problem
        self.path = path
        self.offset = offset

    def __str__(self) -> str:
        where = f"{self.path}: " if self.path else ""
        return f"{where}{self.problem} at byte {self.offset}"


class ValidationError(ValueError):
    """A value that its field cannot hold.

    `path` names the field, `allowed` says what it can hold, `value` is what it holds. A
    `problem` is reported instead of "must be `allowed`, not `value`".
    """

    def __init__(
        self, path: str, allowed: str, value: object, problem: str = ""
    ) -> None:
        super().__init__(path, allowed, value, problem)
        self.path = path
        self.allowed = allowed
        self.value = value
        self.problem = problem

    def __str__(self) -> str:
        where = f"{self.path}: " if self.path else ""
        if self.problem:
            return where + self.problem
        text = repr(self.value)
        if len(text) > 80:
            text = text[:77] + "..."
        return f"{where}must be {self.allowed}, not {text}"

    def at(self, path: str, kind: type[ValidationError] | None = None) -> Any:
        """Return the same error for another path, or of another kind."""
        return (kind or type(self))(path, self.allowed, self.value, self.problem)


class FieldTypeError(ValidationError, TypeError):
    """A value of the wrong type, detected at its assignment."""


class FieldRangeError(ValidationError, OverflowError):
    """A number that is too large or too small, detected at its assignment."""


class FieldCheckError(ValidationError, AssertionError):
    """A value that `check_fields` refuses; rosidl's classes raise AssertionError."""


class FieldNameError(FieldTypeError, FieldCheckError):
    """A name that no field has; rosidl's `check_fields` raises AssertionError before Lyrical."""


class importing:
    """A context that says, when an import in it fails, how to get the package."""

    def __enter__(self) -> None:
        pass

    def __exit__(
        self, _kind: object, error: BaseException | None, _trace: object
    ) -> None:
        # a package that misses its runtime says so itself
        if (
            isinstance(error, ImportError)
            and not isinstance(error, MissingPackageError)
            and error.name != "idlc_runtime"
        ):
            raise missing_package(error) from error


class MissingPackageError(ImportError):
    """Another package's messages cannot be imported."""


def missing_package(error: ImportError) -> MissingPackageError:
    """Return an ImportError that says how to get the package that `error` missed."""
    package = (error.name or "").partition(".")[0] or "another package"
    return MissingPackageError(
        f"this message needs {package}, which cannot be imported ({error}). "
        f"Either install the ROS package (for Jazzy: pip install ros-jazzy-"
        f"{package.replace('_', '-')}), or let those who generate this code run "
        f"`idlc gen` with --vendor-deps: then it comes with what it needs.",
        name=error.name,
        path=error.path,
    )
