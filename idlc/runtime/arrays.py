"""Fixed-size numeric arrays, held as `numpy.ndarray`. Imported only by modules with such fields."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from .cdr import NATIVE
from .sequences import FEW, NUMBERS, NumberField, element_type

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


_DTYPES = [np.dtype(name.lower()) for name in NUMBERS]
INT8, UINT8, INT16, UINT16, INT32, UINT32, INT64, UINT64, FLOAT32, FLOAT64 = _DTYPES

zeros = np.zeros


class NumberArray(NumberField, Generic[Element]):
    """A field of `size` numbers that reads as a `numpy.ndarray`."""

    dtype: Any

    def __init__(self, size: int) -> None:
        self.convert = partial(converted, self.dtype, size)

    @classmethod
    def of(cls, values: tuple[float, ...]) -> NDArray[Element]:
        """Return what the field holds for some values."""
        return np.array(values, cls.dtype)

    if TYPE_CHECKING:

        def __get__(self, message: object, owner: Any = None) -> NDArray[Element]: ...
        def __set__(self, message: object, values: ArrayLike) -> None: ...


if TYPE_CHECKING:
    Int8Array: TypeAlias = NumberArray[np.int8]
    UInt8Array: TypeAlias = NumberArray[np.uint8]
    Int16Array: TypeAlias = NumberArray[np.int16]
    UInt16Array: TypeAlias = NumberArray[np.uint16]
    Int32Array: TypeAlias = NumberArray[np.int32]
    UInt32Array: TypeAlias = NumberArray[np.uint32]
    Int64Array: TypeAlias = NumberArray[np.int64]
    UInt64Array: TypeAlias = NumberArray[np.uint64]
    Float32Array: TypeAlias = NumberArray[np.float32]
    Float64Array: TypeAlias = NumberArray[np.float64]
else:
    for (_name, _code), _dtype in zip(NUMBERS.items(), _DTYPES, strict=True):
        _parts = {"code": _code, "dtype": _dtype}
        globals()[f"{_name}Array"] = type(f"{_name}Array", (NumberArray,), _parts)


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


def array_reader(
    order: str, name: str, size: int, reading: Reading
) -> Callable[..., Any]:
    """Return a function that makes a field's value of a buffer, from a position on."""
    dtype, wire = np.dtype(name), element_type(order, name, reading)
    ndarray, frombuffer, length = np.ndarray, np.frombuffer, size * dtype.itemsize
    if not reading.copy:
        return lambda data, start=0: frombuffer(data, wire, size, start)

    def native(data: Any, start: int = 0) -> Any:
        raw = data if size < FEW else memoryview(data)
        return ndarray(size, dtype, bytearray(raw[start : start + length]))

    def swapped(data: Any, start: int = 0) -> Any:
        return native(data, start).byteswap()

    return native if order == NATIVE or dtype.itemsize == 1 else swapped
