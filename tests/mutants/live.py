"""Exchanges the code of live functions, wherever they are: methods, closures, what is decorated."""

import gc
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, ModuleType

PLAIN = (int, float, str, bytes, tuple, set, frozenset, dict, list)


class Live:
    """The functions of some modules, and how to change them."""

    def __init__(self, modules: dict[Path, ModuleType]) -> None:
        self._modules = modules
        self._functions: dict[str, list[FunctionType]] = {str(path): [] for path in modules}
        for each in gc.get_objects():
            if type(each) is FunctionType and each.__code__.co_filename in self._functions:
                self._functions[each.__code__.co_filename].append(each)

    def maker(self, path: Path, new: CodeType) -> Callable[[], None]:
        """What makes the functions and constants of a file those of `new`.

        Raises ValueError where that changes nothing, or cannot be done.
        """
        codes = self._codes(path, new)
        constants = {} if codes else self._constants(path, new)
        if not codes and not constants:
            raise ValueError("nothing to change")

        def make() -> None:
            for function, code in codes:
                function.__code__ = code
            vars(self._modules[path]).update(constants)

        return make

    def _codes(self, path: Path, new: CodeType) -> list[tuple[FunctionType, CodeType]]:
        old = dict(_named(compile(path.read_text(), str(path), "exec")))
        by_code = {old[name]: code for name, code in _named(new) if name in old}
        found = []
        for function in self._functions[str(path)]:
            code = by_code.get(function.__code__, function.__code__)
            if len(code.co_freevars) != len(function.__code__.co_freevars):
                raise ValueError(f"{function.__qualname__} has other free variables")
            if code != function.__code__:
                found.append((function, code))
        return found

    def _constants(self, path: Path, new: CodeType) -> dict[str, object]:
        """The constants of a module that differ; only its own functions see them."""
        module = self._modules[path]
        fresh = {"__name__": module.__name__, "__file__": str(path)}
        exec(new, fresh)
        return {
            name: value
            for name, value in fresh.items()
            if isinstance(value, PLAIN) and value != getattr(module, name, value)
        }


def _named(code: CodeType) -> Iterator[tuple[tuple[str, int], CodeType]]:
    """All code in `code`, by qualified name and how many had that name before."""
    seen = Counter[str]()
    waiting = [code]
    while waiting:
        each = waiting.pop(0)
        seen[each.co_qualname] += 1
        yield (each.co_qualname, seen[each.co_qualname]), each
        waiting += [const for const in each.co_consts if isinstance(const, CodeType)]
