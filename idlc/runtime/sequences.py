"""Descriptors of fields in a class body: conversions on assignment, and mutable defaults.

Numeric sequences convert to an `array.array`, others to a `list`. Only classes for
distributions whose own ones do it make lists, from Lyrical on.
"""

from __future__ import annotations

from array import array

from .cdr import NATIVE, single_bytes
from .names import FieldTypeError, name_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from functools import partial
    from typing import Any, Generic, TypeAlias, TypeVar

    from .codec import Reading

    Element = TypeVar("Element")
    Number = TypeVar("Number", int, float)
    Value = TypeVar("Value")
else:
    # functools and typing take longer to import than all that is here
    from _functools import partial

    class Generic:
        """A base that can be subscripted and does nothing."""

        def __class_getitem__(cls, _parameters):
            return cls

    Element = Number = Value = None


#: The codes of other buffers for the same numbers, where C has two names for them.
SAME_NUMBER = {"l": "q", "L": "Q"} if array("l").itemsize == 8 else {"l": "i", "L": "I"}

#: From so many numbers on, copying them takes longer than it takes not to.
MANY = 1 << 16
#: Below so many, copying them once more takes less time than a memoryview.
FEW = 1 << 10
#: What `array` itself takes as rosidl means it: the memory of bytes, the elements of others.
_TAKEN = (list, tuple, array, bytes, bytearray)


def converted(code: str, values: Any) -> Any:
    """Return `values` as a new array of type `code`, as rosidl's classes do.

    Bytes are the memory of the elements. Buffers of the same type (of numpy, memoryview) are
    copied whole. Errors are those of `array`.
    """
    if isinstance(values, _TAKEN):
        return array(code, values)
    try:
        view = memoryview(values)
    except TypeError:
        return array(code, values)
    if view.ndim != 1:
        return array(code, values)
    if SAME_NUMBER.get(view.format, view.format) != code:
        return array(code, values.tolist() if hasattr(values, "tolist") else values)
    result = array(code)
    if view.nbytes:
        result.frombytes(view.cast("B") if view.c_contiguous else view.tobytes())
    return result


class NumberField:
    """A field that takes any sequence of numbers and reads as what `convert` makes of it.

    In the class body it stands for the field; the metaclass puts a property in its place.
    """

    convert: Callable[[Any], Any]
    #: The type of an element in `struct`.
    code: str

    def property_of(self, slot: Any) -> property:
        """Return the property over the slot member `slot`."""
        convert = self.convert
        name = name_of(slot)
        store = slot.__set__

        def setter(message: object, values: Any) -> None:
            try:
                store(message, convert(values))
                return
            except (TypeError, ValueError, OverflowError) as error:
                failure = error
            from .checked import refused

            raise refused(message, name, values, failure) from None

        return property(slot.__get__, setter)

    @classmethod
    def __get_pydantic_core_schema__(cls, _source: Any, handler: Any) -> Any:
        """Return how pydantic checks and writes the numbers."""
        from .conversions import numbers_schema

        kind = float if cls.code in "fd" else int
        return numbers_schema(handler.generate_schema(list[kind]))  # type: ignore[valid-type]


class NumberSequence(NumberField, Generic[Number]):
    """A field that reads as an `array.array`."""

    def __init__(self) -> None:
        self.convert = partial(converted, self.code)

    @classmethod
    def of(cls, values: tuple[Number, ...]) -> array[Number]:
        """Return what the field holds for some values."""
        return array(cls.code, values)

    if TYPE_CHECKING:

        def __get__(self, message: object, owner: Any = None) -> array[Number]: ...
        def __set__(self, message: object, values: Iterable[Number]) -> None: ...


#: The codes of numbers, by what the names of their classes begin with.
_NAMES = "Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Float32 Float64"
NUMBERS = dict(zip(_NAMES.split(), "bBhHiIqQfd", strict=True))
if TYPE_CHECKING:
    Int8Sequence: TypeAlias = NumberSequence[int]
    UInt8Sequence: TypeAlias = NumberSequence[int]
    Int16Sequence: TypeAlias = NumberSequence[int]
    UInt16Sequence: TypeAlias = NumberSequence[int]
    Int32Sequence: TypeAlias = NumberSequence[int]
    UInt32Sequence: TypeAlias = NumberSequence[int]
    Int64Sequence: TypeAlias = NumberSequence[int]
    UInt64Sequence: TypeAlias = NumberSequence[int]
    Float32Sequence: TypeAlias = NumberSequence[float]
    Float64Sequence: TypeAlias = NumberSequence[float]
else:
    for _name, _code in NUMBERS.items():
        _name += "Sequence"
        globals()[_name] = type(_name, (NumberSequence,), {"code": _code})


def to_list(
    values: Any, name: str, read: Callable[[bytes], list[Any]] | None = None
) -> list[Any]:
    """Return `values` if they are a list, else a new list of them; `read` makes that of bytes.

    Raises FieldTypeError with the `name` of the field.
    """
    if isinstance(values, list):
        return values
    raw = single_bytes(values) if read else None
    if read and raw is not None:
        return read(raw)
    try:
        elements = iter(values)
    except TypeError:
        raise FieldTypeError(name, "a sequence", values) from None
    return list(elements)


class ListOf(Generic[Element]):
    """A field that reads as a `list` and takes any iterable; `read` makes a list of bytes.

    In the class body it stands for the field; the metaclass puts a property in its place.
    """

    def __init__(self, read: Callable[[bytes], list[Element]] | None = None) -> None:
        self._read = read

    def property_of(self, slot: Any) -> property:
        """Return the property over the slot member `slot`."""
        read = self._read
        name = name_of(slot)
        store = slot.__set__

        def setter(message: object, values: Any) -> None:
            store(message, to_list(values, name, read))

        return property(slot.__get__, setter)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """Return how pydantic checks and writes a list."""
        return handler.generate_schema(list[source.__args__])

    if TYPE_CHECKING:

        def __get__(self, message: object, owner: Any = None) -> list[Element]: ...
        def __set__(self, message: object, values: Iterable[Element]) -> None: ...

    else:

        def __class_getitem__(cls, element):
            """Return the class with its element, which pydantic asks for."""
            return type(list[element])(cls, element)


def sequence_writer(order: str, code: str) -> Callable[[Any], Any]:
    """Return a function that makes a new array in the wire's byte order.

    Not of a value whose type is `array_of(order)`: that is written as it is.
    """

    def swapped(values: Any) -> Any:
        result = array(code, converted(code, values))
        result.byteswap()
        return result

    return partial(converted, code) if order == NATIVE else swapped


def array_of(order: str) -> Any:
    """Return the type of the arrays whose elements are in the wire's byte order already."""
    return array if order == NATIVE else None


def sequence_copier(order: str, code: str) -> Callable[[Any], Any]:
    """Return a function that turns a field's value into bytes in the wire's byte order.

    These are not copied if there are many; then the array cannot change its length meanwhile.
    """
    write = sequence_writer(order, code)
    plain = array_of(order)

    def copy(values: Any) -> Any:
        if type(values) is not plain:
            values = write(values)
        if len(values) < MANY:
            return values.tobytes()
        return memoryview(values).cast("B")

    return copy


def element_type(order: str, name: str, reading: Reading) -> Any:
    """Return the numpy type of the elements of views; copies need none."""
    if reading.copy:
        return None
    import numpy as np

    dtype: Any = np.dtype(name)
    return dtype.newbyteorder(order)


def sequence_reader(order: str, code: str, reading: Reading) -> Callable[..., Any]:
    """Return a function that makes a field's value of a buffer.

    It takes the buffer, the `element_type`, the number of elements and their position. The value
    is a new `array.array`, shorter if the buffer is, or a `numpy.ndarray` over the buffer.
    """
    if not reading.copy:
        import numpy as np

        return np.frombuffer
    empty = array(code)
    new, size = empty.__copy__, empty.itemsize  # half of what `array(code)` takes

    def native(data: Any, _element: Any, count: int, start: int) -> Any:
        raw = data if count < FEW else memoryview(data)
        result = new()
        result.frombytes(raw[start : start + size * count])
        return result

    def swapped(*part: Any) -> Any:
        result = native(*part)
        result.byteswap()
        return result

    return native if order == NATIVE else swapped


# defaults


class Fresh(Generic[Value]):
    """A class attribute whose value is created at each access, for mutable defaults."""

    def __init__(self, make: Callable[[Any], Value], *values: Any) -> None:
        self._make = make
        self._values = values

    def __get__(self, instance: object, owner: type | None = None) -> Value:
        """Return a new value."""
        return self._make(self._values)


class FreshList(Fresh[list[Value]]):
    """A class attribute whose value is a new list of the same values at each access."""

    def __init__(self, *values: Value) -> None:
        super().__init__(list, *values)


def several(kind: Any, count: int) -> list[Any]:
    """Return a list of `count` new instances."""
    return [kind() for _ in range(count)]
