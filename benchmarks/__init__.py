"""Benchmarks: one module a subject, each with ``main(arguments)`` that prints a table.

``python -m benchmarks`` runs them all, ``python -m benchmarks.stability`` one. ``--write``
puts the table into ``docs/benchmarks_<subject>.md`` as well.
"""
