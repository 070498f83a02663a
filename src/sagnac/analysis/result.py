"""Everything that one recording gave, and the coefficients that its answer rests on."""

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import partial
from html import escape
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Self

from sagnac.analysis.settings import Settings
from sagnac.analysis.spectra import Residual, Spectrum
from sagnac.analysis.table_shares import Share, Triad
from sagnac.core.arrays import FloatArray, pandas_for
from sagnac.core.errors import Note, RecordingError, extra_module, path_of, refusal, require_type
from sagnac.core.overwriting import Outputs, require_free
from sagnac.core.units import SENSED, UNITS, Sensor
from sagnac.core.whole_files import write_text
from sagnac.lines.model import Line
from sagnac.noise.estimates import Coefficients, Estimate, Fit, FitName, each_changed
from sagnac.noise.laws import COEFFICIENT_NAMES, CoefficientName
from sagnac.noise.model_average import ModelChoice
from sagnac.recording.model import Recording
from sagnac.spectrum.levels import Levels
from sagnac.stability.curve import StabilityCurve

_FIGURES: Final = ("value", "low", "high")


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """N of a part of the record.

    Attributes
    ----------
    start_s, stop_s
        Of the part, s.
    value, low, high
        N, rad/sqrt(s); NaN if the part does not show it.
    """

    start_s: float
    stop_s: float
    value: float = math.nan
    low: float = math.nan
    high: float = math.nan

    def __post_init__(self) -> None:
        if not self.start_s < self.stop_s:
            raise refusal("start_s", f"is {self.start_s} and stop_s {self.stop_s}; give them so")
        if self.shows and not self.low <= self.value <= self.high:
            raise ValueError(f"value {self.value} must lie within [{self.low}, {self.high}]")

    @property
    def shows(self) -> bool:
        """Whether the part shows N."""
        return not math.isnan(self.value)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Covariance:
    """Joint covariance of coefficients of one gyro.

    Attributes
    ----------
    names
        Of the coefficients.
    matrix
        (names, names), SI.
    """

    names: tuple[CoefficientName, ...]
    matrix: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Analysis:
    """Everything one recording gave; what the report, the JSON and the tables are made of.

    Of several gyros at rest each has an analysis of its own in `gyros`, and `each` gives them one
    by one; `to_frame` has a row for every one. All other figures are then those of the **first**
    gyro alone, which `channel` names: ``for one in analysis.each: one.lines`` has the lines of all.

    Attributes
    ----------
    recording
        The input, as read (values included; the report takes only facts from it).
    settings
        What was asked for; the gyros are those taken.
    channel
        ``x`` or ``x-z``. Of a difference of two gyros all is per gyro, except the lines.
    table_rate
        Mean table rate, rad/s, or None at rest.
    angle_random_walk
        The answer, SI (rad/sqrt(s)), with the fit it rests on in `source`. Of several gyros at rest
        it is that of the first: `gyros` holds each.
    source
        What the answer rests on, in words.
    fits
        By method.
    lines
        Every periodic component found in `channel`, strongest first.
    curve, curve_before
        Stability of `channel` after and before removal, at the same interval.
    curve_of_answer
        The curve without what the answer is without, if that is left in `curve`; else None.
    spectrum, spectrum_before
        One-sided rate spectrum of `channel` after and before removal, smoothed for a figure.
    per_gyro
        N of each of several gyros at rest; of a triad on a table by three-cornered hat; else empty.
    notes
        Every repair, refusal and doubt.
    seconds
        Wall time by stage.
    family
        One curve for each estimator that the settings ask for.
    density
        One-sided multitaper rate spectrum of what the curves are of, if estimators are asked for.
    average
        What the average over bands and terms rests on; None if there is none.
    coefficients
        Q, N, B, K and R of the answer, of one gyro; empty if there is no average.
    covariance
        Of those that are estimated; None if there is no average.
    parts
        The answer over parts of the recording, of one gyro.
    residual
        What removal leaves, against time and table angle; None if it was not kept.
    gyros
        Of several gyros at rest: each analyzed by itself, by name. All else is of the first of
        them, except `per_gyro`, `settings`, `notes` and `seconds`. Else empty.
    accelerometers
        The accelerometers of the recording, each analyzed by itself, by name; all figures are in
        m/s² where those of a gyro are in rad/s.
    refused
        Why there is no analysis of a gyro or an accelerometer, by name.
    shares
        What each gyro shows of the table's rate; empty at rest.
    triad
        Scale factor and axes of three gyros on a turning table, else None.
    masked
        (low, high) bands of the spectrum whose noise went with the lines, Hz.
    levels
        Of the spectrum that the average is of; None if there is no average, or it was read.
    stored
        The document that the analysis was read from (`from_json`), else None. Such an analysis has
        no `recording`, no spectra, no curve from before the removal and no residual; `density`,
        `shares`, `triad`, `masked` and `levels` stay empty, and so do the band and the squares of
        its fits, the mask, the fall and the law of `average`, and the notes of its curves. Its
        settings are those that the document states: gyros, method, interval, confidence and
        estimators.

    Examples
    --------
    >>> import numpy as np
    >>> from sagnac import Recording, analyze
    >>> rate = 1e-6 * np.sqrt(10.0) * np.random.default_rng(1).standard_normal(6000)
    >>> still = Recording.from_arrays(x=rate, kind="rate", unit="rad/s", sample_rate=10.0)
    >>> analysis = analyze(still)
    >>> analysis.angle_random_walk.status, analysis.angle_random_walk.confidence
    ('estimated', 0.95)
    >>> analysis.angle_random_walk.low < 1e-6 < analysis.angle_random_walk.high
    True
    >>> analysis.coefficients["rate_ramp"].status
    'upper bound'
    """

    recording: Recording
    settings: Settings
    channel: str
    table_rate: float | None
    angle_random_walk: Estimate
    source: str
    curve: StabilityCurve
    curve_before: StabilityCurve
    spectrum: Spectrum
    spectrum_before: Spectrum
    fits: Mapping[FitName, Fit] = field(default_factory=dict)
    lines: tuple[Line, ...] = ()
    per_gyro: Mapping[str, Estimate] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    family: tuple[StabilityCurve, ...] = ()
    curve_of_answer: StabilityCurve | None = None
    density: Spectrum | None = None
    average: ModelChoice | None = None
    coefficients: Coefficients = field(default_factory=dict)
    covariance: Covariance | None = None
    parts: tuple[Part, ...] = ()
    residual: Residual | None = None
    gyros: "Mapping[str, Analysis]" = field(default_factory=dict)
    accelerometers: "Mapping[str, Analysis]" = field(default_factory=dict)
    refused: Mapping[str, RecordingError] = field(default_factory=dict)
    shares: Mapping[str, Share] = field(default_factory=dict)
    triad: Triad | None = None
    masked: tuple[tuple[float, float], ...] = ()
    levels: Levels | None = None
    stored: Mapping[str, Any] | None = None

    def __getattr__(self, name: str) -> Any:
        # Asked only for what is not set.
        if name in type(self).__dataclass_fields__:
            problem = "is not in analysis.json; analyze the recording again to have it"
            raise AttributeError(f"{name} {problem}")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @classmethod
    def of_fields(cls, **given: Any) -> Self:
        """One that has the fields given, and the defaults of others; the rest stays unset."""
        analysis = object.__new__(cls)
        for one in fields(cls):
            # Defaults that are made for each stand in no class.
            if one.default_factory is not MISSING:
                given.setdefault(one.name, one.default_factory())
        analysis.__dict__.update(given)
        return analysis

    @classmethod
    def from_json(cls, path: str | Path) -> "Analysis":
        """The analysis that an ``analysis.json`` holds: the answer, without the recording.

        A text that `to_json` returned is taken in place of a path.

        Raises
        ------
        RecordingError
            If the file cannot be read or breaks its schema.
        """
        read: Analysis = import_module("sagnac.report.document").read_analysis(path)
        return read

    def to_json(self, path: str | Path | None = None, *, force: bool = False) -> str:
        """The document of schema ``sagnac.analysis/1``, also written to `path` if that is given.

        An earlier document at `path` is replaced; with `force` any other file, too.

        Raises
        ------
        RecordingError
            If the file cannot be written, or the analysis is of an accelerometer: a document is of
            gyros, with the accelerometers beside them.
        WouldOverwrite
            If another file is at `path`, and `force` is not set.
        """
        # The document is the report's, which rests on this room: loaded at use, as by the door.
        document = import_module("sagnac.report.document")
        text: str = document.to_json(self.stored or document.analysis_document(self))
        if path is not None:
            path = path_of("path", path)
            require_free(Outputs(paths=(path,), mark=path, kind="analysis"), force=force)
            write_text(path, text + "\n")
        return text

    @property
    def each(self) -> "tuple[Analysis, ...]":
        """The analyses that hold all figures: one for each gyro in `gyros`, or this one alone."""
        return tuple(self.gyros.values()) or (self,)

    def with_units_of_sensor(self) -> "Analysis":
        """The same with estimates and notes that are an accelerometer's, if it is of one."""
        of_sensor = partial(replace, sensor=self.sensor)
        name, own = (SENSED[one].titles["angle_random_walk"] for one in ("gyro", self.sensor))
        # Notes of reading stand among those of the recording as they are.
        read = self.recording.notes
        notes = tuple(
            note if note in read else replace(note, text=note.text.replace(name, own))
            for note in self.notes
        )
        return replace(
            self,
            angle_random_walk=of_sensor(self.angle_random_walk),
            fits={name: fit.with_each(of_sensor) for name, fit in self.fits.items()},
            coefficients=each_changed(self.coefficients, of_sensor),
            notes=notes,
        )

    @property
    def is_pair(self) -> bool:
        """Whether it is of the difference of two gyros."""
        return "-" in self.channel and self.channel not in self.settings.gyros

    @property
    def findings(self) -> tuple[Note, ...]:
        """The notes that are findings on the quality of the data: those with a name."""
        return tuple(note for note in self.notes if note.name)

    def __repr__(self) -> str:
        if self.gyros:
            each = (f"{name} {one.angle_random_walk!r}" for name, one in self.gyros.items())
            gyros = f"{len(self.gyros)} gyros, each alone in .gyros: {', '.join(each)}"
            return f"<Analysis of {gyros}; all else is of {self.channel}, {len(self.notes)} notes>"
        walk, counts = self.angle_random_walk, f"{len(self.lines)} lines, {len(self.notes)} notes"
        return f"<Analysis of {self.channel}: {walk!r}, {counts}>"

    def _repr_html_(self) -> str:
        notes = "".join(f"<li>{escape(str(note))}</li>" for note in self.notes)
        answers = "".join(
            f"<p>Angle random walk of {escape(one.channel)}: "
            f"<b>{escape(repr(one.angle_random_walk))}</b><br>{escape(one.source)}</p>"
            for one in self.each
        )
        return f"{answers}<ul>{notes}</ul>"

    @property
    def sensor(self) -> Sensor:
        """``gyro``, or ``accelerometer`` if it is of one."""
        if self.stored is not None:
            return self.angle_random_walk.sensor
        return self.recording.gyro(self.settings.gyros[0]).sensor

    def _rows(self) -> list[dict[str, Any]]:
        """The answer, a row for each coefficient of each gyro and accelerometer, as shown."""
        rows = []
        for one in (*self.each, *self.accelerometers.values()):
            # N of the answer, which the coefficients beside it may hold as another fit has it.
            coefficients = {**one.coefficients, "angle_random_walk": one.angle_random_walk}
            for name in (name for name in COEFFICIENT_NAMES if name in coefficients):
                estimate = coefficients[name]
                in_field = estimate.in_field_unit()
                row = {"channel": one.channel, "coefficient": name}
                row |= {figure: getattr(in_field, figure) for figure in (*_FIGURES, "unit")}
                how = {"confidence": estimate.confidence, "status": estimate.status}
                rows.append({**row, **how, "text": str(in_field)})
        return rows

    def to_frame(self) -> Any:
        """The answer as a pandas frame: a row for each coefficient of each channel.

        Columns are channel, coefficient, value, low, high, unit (of the field), confidence, status
        and text, which writes the figures or the bound with their unit as a paper would.

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        return pandas_for("an analysis as a data frame").DataFrame(self._rows())

    def to_xarray(self) -> Any:
        """The answer of the gyros as an xarray dataset, with the unit of each variable.

        Returns
        -------
        xarray.Dataset
            A variable for each coefficient over ``channel`` and ``figure`` (value, low, high), in
            the unit of the field, NaN if it was not observable, with its status, such as
            ``angle_random_walk_status``: the value of an upper bound is the bound. Over ``tau``,
            s, the ``deviation`` of the first channel per gyro, ``deviation_low`` and
            ``deviation_high``.

        Raises
        ------
        MissingExtra
            If xarray is not installed.
        """
        xarray = extra_module("xarray", "frames", "an analysis as a dataset")
        of_gyros = (row for row in self._rows() if row["channel"] not in self.accelerometers)
        rows = {(row["channel"], row["coefficient"]): row for row in of_gyros}
        channels = [one.channel for one in self.each]
        variables: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {}
        for name in dict.fromkeys(coefficient for _, coefficient in rows):
            of_channels = [rows.get((channel, name), {}) for channel in channels]
            figures = [[row.get(one, math.nan) for one in _FIGURES] for row in of_channels]
            unit = next(row["unit"] for row in of_channels if row)
            variables[name] = (("channel", "figure"), figures, {"units": unit})
            status = [row.get("status", "not observable") for row in of_channels]
            variables[f"{name}_status"] = (("channel",), status, {})
        rate = UNITS[SENSED[self.sensor].rate_unit]
        for name in ("deviation", "low", "high"):
            values = getattr(self.curve, name) / rate.size
            variable = name if name == "deviation" else f"deviation_{name}"
            variables[variable] = (("tau",), values, {"units": rate.name, "channel": self.channel})
        tau = ("tau", self.curve.tau, {"units": "s"})
        coordinates = {"channel": channels, "figure": list(_FIGURES), "tau": tau}
        stated = {"source": self.source, "confidence": self.angle_random_walk.confidence}
        return xarray.Dataset(variables, coords=coordinates, attrs=stated)

    def with_seconds(self, before: Mapping[str, float]) -> "Analysis":
        """The same with stages that came before it and its gyros, such as reading."""
        gyros = {name: one.with_seconds(before) for name, one in self.gyros.items()}
        return replace(self, seconds={**before, **self.seconds}, gyros=gyros)


def require_analysis(value: Analysis, *, recorded: bool = False) -> None:
    """Refuse what is no analysis, or one without its recording if that is needed.

    Raises
    ------
    TypeError
        With what makes one.
    ValueError
        If it was read from a file.
    """
    require_type("analysis", value, Analysis, "give what analyze(recording) returns")
    if recorded and value.stored is not None:
        lacking = "neither the recording nor spectra and residual"
        remedy = "analyze the recording again, and give that"
        raise ValueError(f"analysis was read from a file, which holds {lacking}; {remedy}")


def require_gyro(analysis: Analysis) -> None:
    """Refuse an accelerometer where figures of gyros are made or compared.

    Raises
    ------
    RecordingError
        If the analysis is of one.
    """
    if analysis.sensor == "accelerometer":
        problem = "is an accelerometer, and documents, limits and navigation are of gyros"
        remedy = "analyze it beside a gyro, and give the analysis of both"
        raise RecordingError(problem, channel=analysis.channel, remedy=remedy)


def headline_fit(analysis: Analysis) -> Fit | None:
    """The fit that the answer rests on, or None if the answer is of no fit."""
    walk, fits = analysis.angle_random_walk, analysis.fits.values()
    return next((fit for fit in fits if fit.coefficients.get("angle_random_walk") == walk), None)


def headline_coefficients(analysis: Analysis) -> Coefficients:
    """All coefficients beside the answer: of the average, else of the fit; none of neither."""
    if analysis.coefficients:
        return analysis.coefficients
    fit = headline_fit(analysis)
    return {} if fit is None else fit.coefficients


def answer_coefficients(analysis: Analysis) -> Coefficients:
    """All coefficients beside the answer, with the answer among them."""
    return {**headline_coefficients(analysis), "angle_random_walk": analysis.angle_random_walk}


def headline_estimates(analysis: Analysis) -> dict[CoefficientName, Estimate]:
    """Coefficients estimated or bounded beside the answer, else the answer alone."""
    estimates = headline_coefficients(analysis) or answer_coefficients(analysis)
    known = (name for name in COEFFICIENT_NAMES if name in estimates)
    return {name: estimates[name] for name in known if estimates[name].status != "not observable"}
