"""Fixed-size numeric arrays, held as `numpy.ndarray`. Imported only by modules with such fields."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from .cdr import NATIVE
from .names import name_of

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import ArrayLike, NDArray

    from .codec import Reading

    Values: TypeAlias = ArrayLike
else:

    def __getattr__(name: str) -> Any:
        """Return what only annotations use, for who evaluates them."""
        if name == "Values":
            from numpy.typing import ArrayLike

            return ArrayLike
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


Element = TypeVar("Element", bound="np.generic")


def converted(dtype: Any, size: int, values: Any) -> Any:
    """Return `values` as a new array of `size` elements, as rosidl's classes do.

    Errors are those of numpy, and ValueError for another size.
    """
    if dtype.itemsize == 1 and isinstance(values, bytes):
        values = bytearray(values)
    result = np.array(values, dtype)
    if result.shape == (size,):
        return result
    if result.shape[:1] == (size,) and result.size == size:  # a column
        return result.reshape(size)
    raise ValueError(f"needs an array of {size} elements, not of shape {result.shape}")


INT8 = np.dtype("int8")
UINT8 = np.dtype("uint8")
INT16 = np.dtype("int16")
UINT16 = np.dtype("uint16")
INT32 = np.dtype("int32")
UINT32 = np.dtype("uint32")
INT64 = np.dtype("int64")
UINT64 = np.dtype("uint64")
FLOAT32 = np.dtype("float32")
FLOAT64 = np.dtype("float64")

zeros = np.zeros


class NumberArray(Generic[Element]):
    """A field that reads as a `numpy.ndarray` and takes any sequence of `size` numbers.

    In the class body it stands for the field; the metaclass puts a property in its place.
    """

    dtype: Any

    def __init_subclass__(cls, dtype: Any) -> None:
        cls.dtype = dtype

    def __init__(self, size: int) -> None:
        self.size = size

    def property_of(self, slot: Any) -> property:
        """Return the property over the slot member `slot`."""
        dtype, size = self.dtype, self.size
        name = name_of(slot)
        store = slot.__set__

        def setter(message: object, values: Any) -> None:
            try:
                store(message, converted(dtype, size, values))
                return
            except (TypeError, ValueError, OverflowError) as error:
                failure = error
            from .checked import refused

            raise refused(name, dtype.name, size, values, failure) from None

        return property(slot.__get__, setter)

    @classmethod
    def of(cls, values: tuple[float, ...]) -> NDArray[Element]:
        """Return what the field holds for some values."""
        return np.array(values, cls.dtype)

    @classmethod
    def __get_pydantic_core_schema__(cls, _source: Any, handler: Any) -> Any:
        """Return how pydantic checks and writes an array."""
        from .conversions import numbers_schema

        kind = float if cls.dtype.kind == "f" else int
        return numbers_schema(handler.generate_schema(list[kind]))  # type: ignore[valid-type]

    if TYPE_CHECKING:

        def __get__(
            self, message: object, owner: type | None = None
        ) -> NDArray[Element]: ...
        def __set__(self, message: object, values: ArrayLike) -> None: ...


class Int8Array(NumberArray["np.int8"], dtype=INT8):
    """An array of int8."""


class UInt8Array(NumberArray["np.uint8"], dtype=UINT8):
    """An array of uint8, or of char."""


class Int16Array(NumberArray["np.int16"], dtype=INT16):
    """An array of int16."""


class UInt16Array(NumberArray["np.uint16"], dtype=UINT16):
    """An array of uint16."""


class Int32Array(NumberArray["np.int32"], dtype=INT32):
    """An array of int32."""


class UInt32Array(NumberArray["np.uint32"], dtype=UINT32):
    """An array of uint32."""


class Int64Array(NumberArray["np.int64"], dtype=INT64):
    """An array of int64."""


class UInt64Array(NumberArray["np.uint64"], dtype=UINT64):
    """An array of uint64."""


class Float32Array(NumberArray["np.float32"], dtype=FLOAT32):
    """An array of float32."""


class Float64Array(NumberArray["np.float64"], dtype=FLOAT64):
    """An array of float64."""


def array_writer(order: str, name: str, size: int) -> Callable[[Any], bytes]:
    """Return a function that turns a field's value into bytes of byte order `order`."""
    dtype = np.dtype(name)
    ndarray = np.ndarray

    def native(values: Any) -> bytes:
        if type(values) is ndarray and values.dtype is dtype and len(values) == size:
            return values.tobytes()
        return converted(dtype, size, values).tobytes()  # type: ignore[no-any-return]

    def swapped(values: Any) -> bytes:
        return converted(dtype, size, values).byteswap().tobytes()  # type: ignore[no-any-return]

    return native if order == NATIVE or dtype.itemsize == 1 else swapped


def buffer_writer(order: str, name: str, size: int) -> Callable[[Any], Any]:
    """Return a function that turns a field's value into a buffer, without a copy if it is one."""
    dtype = np.dtype(name)
    write = array_writer(order, name, size)

    def native(values: Any) -> Any:
        right = type(values) is np.ndarray and values.dtype is dtype
        if right and values.shape == (size,) and values.flags.c_contiguous:
            return values
        return write(values)

    return native if order == NATIVE or dtype.itemsize == 1 else write


def view_reader(order: str, name: str) -> Callable[[Any], Any]:
    """Return a function that makes an array over a buffer, in whichever byte order that is."""
    dtype: Any = np.dtype(name)
    return partial(np.frombuffer, dtype=dtype.newbyteorder(order))


def array_reader(
    order: str, name: str, size: int, reading: Reading
) -> Callable[[Any], Any]:
    """Return a function that turns bytes of byte order `order` into a field's value."""
    if not reading.copy:
        return view_reader(order, name)
    dtype = np.dtype(name)
    ndarray = np.ndarray

    def native(raw: Any) -> Any:
        return ndarray(size, dtype, bytearray(raw))

    def swapped(raw: Any) -> Any:
        return ndarray(size, dtype, bytearray(raw)).byteswap()

    return native if order == NATIVE or dtype.itemsize == 1 else swapped
