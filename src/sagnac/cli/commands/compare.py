"""``sagnac compare``: the methods side by side."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from sagnac import overwriting
from sagnac.cli import output as results
from sagnac.cli import progress as progresses
from sagnac.cli.options import NO_OPTIONS, File, Folder, Force, Options, settings_of, statement_of
from sagnac.cli.progress import Progress
from sagnac.cli.reading import ReadFile, naming, read_file
from sagnac.cli.settings_file import inputs, with_settings

if TYPE_CHECKING:
    from sagnac.analysis.result import Analysis
    from sagnac.analysis.settings import Method, Settings

METHODS: "Final[tuple[Method, ...]]" = ("none", "fris", "fos-korenberg", "fos-paper", "fos")


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Analyses by method; and why, of each method that the recording does not allow."""

    analyses: "Mapping[str, Analysis]"
    refused: Mapping[str, str]

    @property
    def best(self) -> "Analysis":
        """The one that a verdict rests on: fos, or the last if that is not among them."""
        return self.analyses.get("fos") or list(self.analyses.values())[-1]


def compare(
    file: File,
    /,
    *,
    options: Options = NO_OPTIONS,
    output: Folder = None,
    force: Force = False,
) -> int:
    """No removal, fris, fos-korenberg, fos-paper and fos, side by side; with -o also as a page.

    --method picks one to run alone, --gyros one of several gyros at rest, each of which is shown.
    """
    options = with_settings(options)
    statement = statement_of(options)
    settings = settings_of(options)
    results.require_writable(output)
    if output is not None:
        reads = inputs([file], options)
        overwriting.require_free(overwriting.of_comparison(output), reads, force=force)
    methods = (options.method,) if options.method else METHODS
    with progresses.shown() as progress:
        read = read_file(file, statement, progress, memory=options.memory)
        with naming(file, read.recording):
            found = _compared(read, settings, methods, progress)
        written = []
        if output is not None:
            progress("report", 0.0)
            written = results.write_comparison(found.analyses, found.refused, output)
    from sagnac.report import text
    from sagnac.report.document import comparison_document, to_json

    if options.as_json:
        print(to_json(comparison_document(found.analyses, found.refused)))
        return results.verdict_status([found.best])
    for each in text.methods_by_gyro(found.analyses).values():
        print(f"{file}: {text.comparison(each, found.refused)}")
    results.print_paths(written)
    return results.verdict_status([found.best])


def _compared(
    read: ReadFile, settings: "Settings", methods: "Sequence[Method]", progress: Progress
) -> Comparison:
    """Each method; its refusal is an error only if no method gives anything."""
    from sagnac.analysis.pipeline import analyze as run
    from sagnac.errors import RecordingError
    from sagnac.report.command_line import error_text

    analyses: dict[str, Analysis] = {}
    errors: dict[str, RecordingError] = {}
    for method in methods:
        named = progresses.prefixed(progress, method)
        try:
            analysis = run(read.recording, replace(settings, method=method), progress=named)
        except RecordingError as error:
            errors[method] = error
        else:
            analyses[method] = analysis.with_seconds(read.seconds)
    if not analyses:
        raise next(iter(errors.values()))
    return Comparison(
        analyses=analyses,
        refused={method: error_text(error) for method, error in errors.items()},
    )
