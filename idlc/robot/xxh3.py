"""XXH3_128 with seed 0, the hash that rmw_zenoh derives endpoint ids with.

https://github.com/Cyan4973/xxHash/blob/dev/doc/xxhash_spec.md
"""

from __future__ import annotations

from operator import xor
from struct import unpack_from

_SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f"
    "cb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c"
    "3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364"
    "eac5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e"
    "2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)
_MASK = 2**64 - 1
_LOW = 2**32 - 1
_P32_1, _P32_2, _P32_3 = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D
_P1, _P2, _P3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
_P4, _P5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5
_MX1, _MX2 = 0x165667919E3779F9, 0x9FB21C651E98DF25
_STRIPE = 64
_STRIPES = 16  # of a block


def xxh3_128(data: bytes) -> int:
    """Return the hash as a number of 128 bits."""
    size = len(data)
    if size <= 16:
        low, high = _tiny(data)
    elif size <= 240:
        low, high = _short(data)
    else:
        low, high = _long(data)
    return (high & _MASK) << 64 | low & _MASK


def _secret(at: int, count: int) -> tuple[int, ...]:
    return unpack_from(f"<{count}Q", _SECRET, at)


def _avalanche(value: int) -> int:
    value &= _MASK
    value = (value ^ value >> 37) * _MX1 & _MASK
    return value ^ value >> 32


def _avalanche64(value: int) -> int:
    value = (value ^ value >> 33) * _P2 & _MASK
    value = (value ^ value >> 29) * _P3 & _MASK
    return value ^ value >> 32


def _fold(a: int, b: int) -> int:
    product = a * b
    return (product ^ product >> 64) & _MASK


def _tiny(data: bytes) -> tuple[int, int]:
    """Return both halves of the hash of up to 16 bytes; only the lower 64 bits of each count."""
    size = len(data)
    if size > 8:
        a, b, c, d = _secret(32, 4)
        first, last = unpack_from("<Q", data)[0], unpack_from("<Q", data, size - 8)[0]
        product = (first ^ last ^ a ^ b) * _P1
        low, high = (product & _MASK) + (size - 1 << 54) & _MASK, product >> 64
        last ^= c ^ d
        high = high + last + (last & _LOW) * (_P32_2 - 1) & _MASK
        product = (low ^ int.from_bytes(high.to_bytes(8, "big"), "little")) * _P2
        return _avalanche(product), _avalanche((product >> 64) + high * _P2)
    if size > 3:
        first, last = unpack_from("<I", data)[0], unpack_from("<I", data, size - 4)[0]
        a, b = _secret(16, 2)
        product = ((first | last << 32) ^ a ^ b) * (_P1 + (size << 2))
        low = product & _MASK
        high = (product >> 64) + (low << 1) & _MASK
        low ^= high >> 3
        low = (low ^ low >> 35) * _MX2 & _MASK
        return low ^ low >> 28, _avalanche(high)
    if size:
        low = data[0] << 16 | data[size >> 1] << 24 | data[-1] | size << 8
        swapped = int.from_bytes(low.to_bytes(4, "big"), "little")
        high = (swapped << 13 | swapped >> 19) & _LOW
        a, b, c, d = unpack_from("<4I", _SECRET)
        return _avalanche64(low ^ a ^ b), _avalanche64(high ^ c ^ d)
    a, b, c, d = _secret(64, 4)
    return _avalanche64(a ^ b), _avalanche64(c ^ d)


def _short(data: bytes) -> tuple[int, int]:
    """Return both halves of the hash of 17 to 240 bytes."""
    size = len(data)
    low, high = size * _P1, 0

    def mix(first: int, second: int, secret: int) -> None:
        nonlocal low, high
        a, b = unpack_from("<2Q", data, first)
        c, d = unpack_from("<2Q", data, second)
        k = _secret(secret, 4)
        low = (low + _fold(a ^ k[0], b ^ k[1]) ^ c + d & _MASK) & _MASK
        high = (high + _fold(c ^ k[2], d ^ k[3]) ^ a + b & _MASK) & _MASK

    if size <= 128:
        for at in range((size - 1 >> 5) * 16, -1, -16):
            mix(at, size - 16 - at, at * 2)
    else:
        for at in range(0, 128, 32):
            mix(at, at + 16, at)
        low, high = _avalanche(low), _avalanche(high)
        for at in range(128, size - 31, 32):
            mix(at, at + 16, at - 125)
        mix(size - 16, size - 32, 103)
    return (
        _avalanche(low + high),
        -_avalanche(low * _P1 + high * _P4 + size * _P2),
    )


def _long(data: bytes) -> tuple[int, int]:
    """Return both halves of the hash of more than 240 bytes."""
    size = len(data)
    lanes = [_P32_3, _P1, _P2, _P3, _P4, _P32_2, _P5, _P32_1]

    def add(at: int, secret: int) -> None:
        values = unpack_from("<8Q", data, at)
        for i, key in enumerate(map(xor, values, _secret(secret, 8))):
            lanes[i ^ 1] += values[i]
            lanes[i] = lanes[i] + (key & _LOW) * (key >> 32) & _MASK

    stripes = (size - 1) // _STRIPE
    for stripe in range(stripes):
        add(stripe * _STRIPE, stripe % _STRIPES * 8)
        if stripe % _STRIPES == _STRIPES - 1:
            keys = _secret(len(_SECRET) - _STRIPE, 8)
            low = (lane & _MASK for lane in lanes)
            lanes = [(x ^ x >> 47 ^ k) * _P32_1 & _MASK for x, k in zip(low, keys, strict=True)]
    add(size - _STRIPE, len(_SECRET) - _STRIPE - 7)

    def merge(secret: int, start: int) -> int:
        mixed = [(lane & _MASK) ^ k for lane, k in zip(lanes, _secret(secret, 8), strict=True)]
        return _avalanche(start + sum(map(_fold, mixed[::2], mixed[1::2])))

    return merge(11, size * _P1), merge(len(_SECRET) - _STRIPE - 11, ~(size * _P2))
