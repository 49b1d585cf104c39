"""Compiled kernels from a cache, whose intermediate code is read only when another kernel is compiled from it.

Beside the machine code numba keeps each kernel's LLVM module, for those that call it, and reads it with the names of all its symbols
whenever the kernel is loaded: a third of the time of loading. A warm run compiles nothing and needs none of them.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding  # type: ignore[import-untyped]
from numba.core.codegen import JITCodeLibrary


class LazyLibrary(JITCodeLibrary):  # type: ignore[misc]
    """numba's library of one kernel; `_shared_module` is what others link, None where there is none."""

    _parsed: Any = None
    _bitcode: bytes | None = None
    _machine_code = b""

    @property
    def _shared_module(self) -> Any:
        if self._bitcode is not None:
            self._shared_module = binding.parse_bitcode(self._bitcode)
            self._codegen._engine._load_defined_symbols(self._parsed)
        return self._parsed

    @_shared_module.setter
    def _shared_module(self, module: Any) -> None:
        self._parsed, self._bitcode, self._machine_code = module, None, b""

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != "object":
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        machine_code, bitcode = data
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._bitcode, library._machine_code = bitcode, machine_code
        library._finalize_final_module()
        return library

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function of this library; 0 where it is not its own."""
        if self._bitcode is not None:
            if name.encode() + b"\0" in self._machine_code:  # as its table of symbols has it
                self._ensure_finalized()
                return int(self._codegen._engine.get_function_address(name))
            self._shared_module  # noqa: B018 - from here on all names are known
        return int(super().get_pointer_to_function(name))


def link_lazily(codegen: Any) -> None:
    """Let a target make its libraries so; once is enough."""
    if codegen._library_class is JITCodeLibrary:
        codegen._library_class = LazyLibrary
