"""Run every benchmark module in turn, with the arguments given."""

import importlib
import pkgutil
import sys

import benchmarks


def main(arguments: list[str]) -> None:
    for module in pkgutil.iter_modules(benchmarks.__path__):
        if module.name.startswith("_"):
            continue
        run = getattr(importlib.import_module(f"benchmarks.{module.name}"), "main", None)
        # What several of them share has nothing to run.
        if run is not None:
            run(arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
