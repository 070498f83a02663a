"""``sagnac lines``: the periodic components."""

from sagnac.cli import progress as progresses
from sagnac.cli.options import NO_OPTIONS, File, Options, settings_of, statement_of
from sagnac.cli.output import print_documents, verdict_status
from sagnac.cli.reading import naming, read_file
from sagnac.cli.settings_file import with_settings


def lines(file: File, /, *, options: Options = NO_OPTIONS) -> int:
    """The periodic components found, strongest first."""
    options = with_settings(options)
    statement = statement_of(options)
    settings = settings_of(options)
    with progresses.shown() as progress:
        read = read_file(file, statement, progress, memory=options.memory)
        from sagnac.analysis.pipeline import analyze as run

        with naming(file, read.recording):
            analysis = run(read.recording, settings, progress=progress).with_seconds(read.seconds)
    if options.as_json:
        print_documents([analysis], single=True)
        return verdict_status([analysis])
    from sagnac.report import text

    shown = [text.lines(one, most=None) for one in analysis.each]
    print(
        text.blocks(
            text.verdict(analysis), *shown, text.refused(analysis), text.notes(analysis.notes)
        )
    )
    return verdict_status([analysis])
