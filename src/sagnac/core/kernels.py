"""Compiled loops: cached between runs if there is anywhere to cache them, else compiled anew.

And products of matrices by one thread.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any, Final, TypeVar

import numba
import numpy as np
from threadpoolctl import ThreadpoolController

from sagnac.core.errors import Note

# Names of loops that could not be kept for the next run.
_NOT_KEPT: Final[set[str]] = set()

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(**options: Any) -> Callable[[_Function], _Function]:
    """Compile a loop at its first call.

    Without a folder that may be written to (an installation of somebody else's, no home) nothing
    is cached. A cache that is damaged is not used, and is written anew. While a loop runs, other
    threads of the caller, a window that shows progress, go on. A division by zero gives an infinity
    or NaN, as in numpy: loops that have to look for one take a quarter longer to compile.

    Parameters
    ----------
    **options
        Of `numba.njit`: ``fastmath``, ``inline``.
    """

    options = {"nogil": True, "error_model": "numpy", **options}

    def decorate(function: _Function) -> _Function:
        loop: _Function
        try:
            loop = numba.njit(cache=True, **options)(function)
            # NUMBA_DISABLE_JIT: it stays an interpreted loop, with nothing to cache.
            if loop is not function:
                _guard(loop)
        except RuntimeError:
            # There is no folder to cache in.
            _NOT_KEPT.add(function.__qualname__)
            loop = numba.njit(cache=False, **options)(function)
        return loop

    return decorate


# Looks through all libraries of the process, once they are loaded.
_libraries: Final = cache(ThreadpoolController)


@contextmanager
def one_thread() -> Iterator[None]:
    """Inside, products of matrices are of one thread, and what underflows is zero.

    Many are small, a few large: threads would spend their time waiting for each other. Chances too
    small for a number are met everywhere, and a caller may have told numpy to raise errors.
    """
    with _libraries().limit(limits=1, user_api="blas"), np.errstate(under="ignore"):
        yield


def cache_notes() -> tuple[Note, ...]:
    """That compiled loops are lost with this process, if any of those used so far is."""
    if not _NOT_KEPT:
        return ()
    why = "since no folder for them may be written to"
    cost = "every run compiles them anew, which takes five seconds and more"
    text = f"compiled loops are not kept, {why}: {cost}; name a folder in NUMBA_CACHE_DIR"
    return (Note(text=text),)


def _guard(loop: Any) -> None:
    """Let a cache that cannot be read or written cost a compilation, not the run."""
    cache = loop._cache

    def guarded(act: Callable[..., Any], *lost: str) -> Callable[..., Any]:
        def acted(*arguments: Any) -> Any:
            try:
                with warnings.catch_warnings(action="ignore"):
                    return act(*arguments)
            except Exception:
                _NOT_KEPT.update(lost)
                with suppress(OSError):
                    cache.flush()
                return None

        return acted

    cache.load_overload = guarded(cache.load_overload)
    cache.save_overload = guarded(cache.save_overload, loop.__qualname__)
