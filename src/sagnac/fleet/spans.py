"""One long recording as several: a task for each span of it."""

import math
from dataclasses import replace

from sagnac.fleet.results import Result
from sagnac.fleet.tasks import Task


def span_tasks(task: Task, result: Result, span: float) -> tuple[Task, ...]:
    """Tasks of equal spans of a recording, as many as fit.

    Parameters
    ----------
    task, result
        Of the whole recording, which says how long it is.
    span
        Length of each, s.

    Returns
    -------
    tuple of Task
        None if the recording has no result, or is shorter than two spans.

    Raises
    ------
    ValueError
        If `span` is not above zero.
    """
    if not (math.isfinite(span) and span > 0.0):
        raise ValueError(f"span is {span!r}; give seconds above zero")
    first = (task.statement.span or (0.0, None))[0] or 0.0
    count = math.floor(result.duration_s / span * (1.0 + 1e-9))
    if count < 2:
        return ()
    return tuple(
        replace(
            task,
            statement=replace(
                task.statement, span=(first + number * span, first + (number + 1) * span)
            ),
        )
        for number in range(count)
    )


def span_of(task: Task) -> tuple[float, float] | None:
    """Start and stop of the span that a task is of, s; None for a whole recording."""
    limits = task.statement.span
    if limits is None or limits[0] is None or limits[1] is None:
        return None
    return (limits[0], limits[1])
