"""Compiled: arrays that a kernel reads without counting who holds them.

Compiled code counts the references to every array that it hands to a function, with locked instructions; in kernels
that call small functions a million times this took a third of the time. A kernel borrows its arrays once, at its
beginning: its caller holds them until it returns.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic, overload
from numba.np.numpy_support import carray
from numpy.typing import NDArray

Number = TypeVar("Number", bound=np.generic)


@intrinsic
def _pointer(_typing_context: Any, array: Any) -> Any:
    """A pointer to the first element of a C-contiguous array."""
    if not isinstance(array, types.Array) or array.layout != "C":
        raise TypingError(f"{array} cannot be borrowed: not a C-contiguous array")

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        data = context.make_array(array)(context, builder, arguments[0]).data
        return builder.bitcast(data, cgutils.voidptr_t)

    return types.voidptr(array), generate


def borrowed(array: NDArray[Number]) -> NDArray[Number]:
    """The same C-contiguous array, not counted; the caller must hold it for as long as this one is in use."""
    return array


@overload(borrowed)
def _compile_borrowed(array: Any) -> Any:
    def borrow(array: Any) -> Any:
        return carray(_pointer(array), array.shape, array.dtype)  # type: ignore[call-arg]

    return borrow
