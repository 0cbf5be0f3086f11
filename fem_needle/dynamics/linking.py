"""Compiled functions become one library only in the entrance that calls them: LLVM sees each of them once.

On its own numba optimizes a function again in each of its callers, level by level, and makes machine code of each level. A `Part`
is neither optimized beyond itself nor made machine code; the entrance's `Whole` links all parts it needs, and then numba goes on
as usual. This is what half of the time for compiling went into; nothing that is computed changes.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.untyped_passes import IRProcessing

# Passes for what the kernel does not contain: closures, comprehensions, expressions of whole arrays, generators, literal loops.
NEEDLESS = {
    "WithLifting",
    "InlineClosureLikes",
    "RewriteSemanticConstants",
    "DeadBranchPrune",
    "RewriteDynamicRaises",
    "MakeFunctionToJitFunction",
    "InlineInlinables",
    "FindLiterallyCalls",
    "LiteralUnroll",
    "LiteralPropagationSubPipelinePass",
    "InlineOverloads",
    "NopythonRewrites",
    "DumpParforDiagnostics",
}


class Part(JITCodeLibrary):
    """A function that only compiled code calls."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.parts: list[Any] = []

    @property
    def codegen(self) -> Any:
        """Who is told the function's environment: nobody, it has none in memory."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Ignore."""

    def add_linking_library(self, library: Any) -> None:
        """Remember what the function calls."""
        _add_new(self.parts, library)

    def finalize(self) -> None:
        """Leave everything to the `Whole`."""
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return that there is no machine code."""
        self._ensure_finalized()
        return 0

    def alone(self) -> Any:
        """Return the function's module."""
        return super()._get_module_for_linking()

    def _get_module_for_linking(self) -> Any:
        """Return the function's module with all parts, to a library that is no `Whole`."""
        module = self.alone().clone()
        for part in self.parts:
            module.link_in(_alone(part), preserve=True)
        return module


class Whole(JITCodeLibrary):
    """An entrance with everything that it calls."""

    def add_linking_library(self, library: Any) -> None:
        """Link a library and all its parts."""
        _add_new(self._linking_libraries, library)

    def finalize(self) -> None:
        """Link each part once, optimize and make machine code."""
        self._linking_libraries = [_Alone(one) if isinstance(one, Part) else one for one in self._linking_libraries]
        super().finalize()


class _Alone:
    """A part that gives itself to the linker without what it calls."""

    def __init__(self, part: Part) -> None:
        self._part = part

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)

    def _get_module_for_linking(self) -> Any:
        return self._part.alone()


def _alone(library: Any) -> Any:
    return library.alone() if isinstance(library, Part) else library._get_module_for_linking()


def _add_new(libraries: list[Any], library: Any) -> None:
    """Add a library and its parts, callers first: the linker takes a function only where it is called already."""
    library._ensure_finalized()
    libraries += [one for one in (library, *getattr(library, "parts", ())) if one not in libraries]


class _MakeLibrary(AnalysisPass):
    """Decides what a function is compiled into, before numba does."""

    library: Any = None

    def __init__(self) -> None:
        AnalysisPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Set the library."""
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return False


@register_pass(mutates_CFG=False, analysis_only=True)
class _MakePart(_MakeLibrary):
    _name = "needle_part"
    library = Part


@register_pass(mutates_CFG=False, analysis_only=True)
class _MakeWhole(_MakeLibrary):
    _name = "needle_whole"
    library = Whole


def _pipeline(state: Any, library: type[AnalysisPass]) -> list[Any]:
    manager = DefaultPassBuilder.define_nopython_pipeline(state)
    manager.passes = [one for one in manager.passes if one[0].__name__ not in NEEDLESS]
    manager.add_pass_after(library, IRProcessing)
    manager.finalize()
    return [manager]


class InnerCompiler(CompilerBase):
    """Compiles a function into a `Part`."""

    def define_pipelines(self) -> list[Any]:
        """Return the only pipeline."""
        return _pipeline(self.state, _MakePart)


class EntranceCompiler(CompilerBase):
    """Compiles an entrance into a `Whole`."""

    def define_pipelines(self) -> list[Any]:
        """Return the only pipeline."""
        return _pipeline(self.state, _MakeWhole)
