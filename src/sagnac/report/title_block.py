"""Top of a report: what was measured, for whom, by whom."""

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Self


@dataclass(frozen=True, slots=True, kw_only=True)
class TitleBlock:
    """Texts on top of a report; those that are empty are left out.

    Attributes
    ----------
    title
        Of the report.
    device, serial
        The unit under test.
    customer, operator, date
        For whom, by whom and when it was measured.
    """

    title: str = ""
    device: str = ""
    serial: str = ""
    customer: str = ""
    operator: str = ""
    date: str = ""

    @classmethod
    def from_toml(cls, path: Path) -> Self:
        """As a file states it.

        Raises
        ------
        ValueError
            If it is no TOML, or has a key that is none of these.
        OSError
            If it cannot be read.
        """
        try:
            stated = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"heading {path} is no TOML: {error}") from None
        known = [field.name for field in fields(cls)]
        for key in stated:
            if key not in known:
                raise ValueError(f"heading {path}: {key!r} is not known; use {', '.join(known)}")
        return cls(**{key: str(value) for key, value in stated.items()})

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Statements besides the title, each with its name."""
        named = (
            ("Unit", self.device),
            ("Serial number", self.serial),
            ("Customer", self.customer),
            ("Operator", self.operator),
            ("Date", self.date),
        )
        return [(name, value) for name, value in named if value]
