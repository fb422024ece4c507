"""The names of an interface in Python, names that are imported on first use, and errors.

Wire names stay as they are in files, dictionaries and type descriptions. In Python a name that
is a keyword gets a trailing underscore; no name of ROS can end in one, so two names never meet.
"""

from __future__ import annotations

import sys
from keyword import iskeyword

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any


def public_name(name: str) -> str:
    """Return what a field is called as attribute and argument, or a type as class."""
    return name + "_" if iskeyword(name) else name


def slot_name(field: str) -> str:
    """Return the slot that holds a field's value, named as rosidl names it."""
    slot = "_" + field
    # an attribute of classes has this name
    return slot + "_" if slot == "_fields_and_field_types" else slot


def name_of(slot: Any) -> str:
    """Return the public name of the field that a slot's member descriptor holds."""
    name: str = slot.__name__
    return public_name(wire_name(name[1:]))


def wire_name(name: str) -> str:
    """Return the name whose `public_name` is `name`."""
    return name.removesuffix("_")


def owner_of(kind: type) -> Any:
    """Return the generated class that a class is, or that a user's class derives from."""
    owner = getattr(type(kind), "_message", None)
    if owner is None:
        raise TypeError(f"{kind.__name__} is not a generated message class")
    return owner


def stamp(fields: Mapping[str, str]) -> int:
    """Return a number for the fields of a class: their names and types, in order."""
    from binascii import crc32

    return crc32(repr(fields).encode())


def demand_stamp(kind: Any, number: int | None) -> None:
    """Raise ImportError unless a class has the fields that another module was made for."""
    if number is not None and number != stamp(kind._fields_and_field_types):
        package = kind.__module__.rpartition(".")[0]
        raise ImportError(
            f"{package}.{kind.__name__} has other fields than the code that uses it was generated "
            f"for: run `idlc gen` again",
            name=kind.__module__,
        )


def lazily(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` (PEP 562) for a package's names, by their `modules`.

    Classes are found by their names on the wire, too.
    """

    def get(name: str) -> Any:
        if name not in modules:
            name = public_name(name)
        module = modules.get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        # what importlib.import_module does, without its import
        value = getattr(__import__(f"{package}.{module}", fromlist=[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        own = {*vars(sys.modules[package]), *modules}
        return sorted(own - {"TYPE_CHECKING", "annotations"})

    return get, names


# errors


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
        if not isinstance(error, ImportError) or isinstance(error, MissingPackageError):
            return
        # a package says itself that it lacks its runtime
        if error.name == "idlc_runtime":
            return
        package = (error.name or "").partition(".")[0] or "another package"
        how = (
            f"Either install the ROS package (for Jazzy: pip install ros-jazzy-"
            f"{package.replace('_', '-')}), or generate this code "
            f"again with `idlc gen --vendor-deps`, which copies the types that it needs."
        )
        if package == "numpy":
            how = "Install it: pip install numpy."
        raise MissingPackageError(
            f"this message needs {package}, which cannot be imported ({error}). {how}",
            name=error.name,
            path=error.path,
        ) from error


class MissingPackageError(ImportError):
    """Another package's messages cannot be imported."""
