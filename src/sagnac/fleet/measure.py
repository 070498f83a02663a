"""One task done: read, analyzed, its report and its result written. Runs in any process."""

from pathlib import Path
from typing import Final

from sagnac.analysis.pipeline import analyze
from sagnac.errors import RecordingError
from sagnac.fleet.results import Result, done, write_result
from sagnac.fleet.tasks import Task, require_same_file
from sagnac.formats import read
from sagnac.report.command_line import error_text
from sagnac.report.document import analysis_document, to_json
from sagnac.report.files import write_text
from sagnac.report.page import write_page

_REPORTS: Final = "reports"


def measure(task: Task, folder: Path) -> Result:
    """Analyze a recording, write its report, and then its result.

    Nothing is raised for what is wrong with the recording: that is a result, too. What is wrong
    with the machine, such as memory or disk that ran out, is a result that is not kept.

    Parameters
    ----------
    task
        What to do.
    folder
        Of the campaign, as this process sees it.
    """
    try:
        result = _measured(task, folder)
    except RecordingError as error:
        result = Result(key=task.key, state="failed", reason=error_text(error))
    except MemoryError:
        return lost(task, "memory ran out; allow fewer workers")
    except OSError as error:
        return lost(task, f"{error.filename or task.path}: {error.strerror or error}")
    except Exception as error:
        return lost(task, f"{task.path}: internal error: {type(error).__name__}: {error}")
    write_result(folder, result)
    return result


def lost(task: Task, reason: str) -> Result:
    """The result of a task that the next start tries again."""
    return Result(key=task.key, state="lost", reason=" ".join(reason.split()))


def _measured(task: Task, folder: Path) -> Result:
    recording = read(task.path, task.statement)
    if recording.provenance is not None and task.sha256:
        require_same_file(task, recording.provenance.sha256)
    analysis = analyze(recording, task.settings)
    report = Path(_REPORTS) / f"{Path(task.path).stem}-{task.key[:12]}"
    (folder / report).mkdir(parents=True, exist_ok=True)
    document = analysis_document(analysis)
    write_page(analysis, folder / report / "report.html")
    write_text(folder / report / "analysis.json", to_json(document) + "\n")
    return done(task, document, report.as_posix())
