"""Compiled code that is kept on the disk for the next start, wherever a place for it can be found."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from typing import Any

import numba
from numba.core import config
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    _CacheLocator,  # pyright: ignore[reportPrivateUsage] - what every place of numba's derives from
    _SourceFileBackedLocatorMixin,  # pyright: ignore[reportPrivateUsage]
)

log = logging.getLogger("opspace")


class _Reading(_SourceFileBackedLocatorMixin, _CacheLocator):  # pyright: ignore[reportIncompatibleMethodOverride]
    """The first place that numba would write to, for a user who may only read there.

    Whoever installed may have compiled already; without any place numba refuses the function.
    """

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file = file
        self._lineno = function.__code__.co_firstlineno

    def ensure_cache_path(self) -> None:
        """Ask for nothing: it need not be there."""

    def get_cache_path(self) -> str:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the directory that is set, or that beside the source."""
        if directory := getattr(config, "CACHE_DIR", ""):
            return os.path.join(directory, self.get_suitable_cache_subpath(self._py_file))
        return os.path.join(os.path.dirname(os.path.abspath(self._py_file)), "__pycache__")


class _Places(CompileResultCacheImpl):
    _locator_classes = [*CompileResultCacheImpl._locator_classes, _Reading]  # noqa: RUF012


class _Cache(FunctionCache):
    _impl_class = _Places


class _File(IndexDataCacheFile):
    """What is kept of one function: nothing where the disk is full or cannot be read."""

    def _load_index(self) -> dict[Any, str]:
        try:
            return super()._load_index()
        except OSError as error:
            log.debug("kept code cannot be read: %s", error)
            return {}

    def save(self, key: Any, data: Any) -> None:
        """Write what was compiled, if that is possible."""
        try:
            super().save(key, data)
        except OSError as error:
            log.debug("compiled code is not kept: %s", error)


def compile_and_keep(
    function: Callable[..., Any],
    *,
    stamp: object = None,
    generation: int = 0,
    **options: Any,
) -> Any:
    """Compile a function at first use; read it from the disk where it is kept.

    Args:
        function: The function.
        stamp: What the compiled code is made of: with another one, what is kept is old. None takes
            the contents of the function's file.
        generation: Part of the names of the files.
        options: What `numba.njit` takes.
    """
    compiled: Any = numba.njit(**options)(function)
    cache: Any = _Cache(function)
    name = cache._impl.filename_base
    cache._cache_file = _File(
        cache_path=cache._cache_path,
        filename_base=f"{name}-{generation}" if generation else name,
        source_stamp=cache._impl.locator.get_source_stamp() if stamp is None else stamp,
    )
    compiled._cache = cache
    return compiled


def is_kept(compiled: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether the disk holds a function, compiled for arguments of these types on this processor."""
    cache = compiled._cache
    signature = tuple(numba.typeof(argument) for argument in arguments)
    file = cache._cache_file
    name = file._load_index().get(cache._index_key(signature, compiled.targetctx.codegen()))
    return name is not None and os.path.exists(file._data_path(name))


def can_be_kept(compiled: Any) -> bool:
    """Whether there is a directory for compiled code that this user may write to."""
    return not isinstance(compiled._cache._impl.locator, _Reading)
