"""Signatures as the site shows them: names and short defaults."""

import inspect
from typing import Any, Final

# The library alone makes these: see the page of the library.
MADE: Final = (
    "Analysis",
    "CampaignReport",
    "Estimate",
    "Exported",
    "Fit",
    "Foresight",
    "Line",
    "Note",
    "OrthogonalSearch",
    "Plans",
    "Removal",
    "Report",
    "SelfNoise",
    "StabilityCurve",
    "Trial",
    "Verdict",
)
# Longest default value that is shown; longer ones stand at what they are of.
_LONGEST_DEFAULT: Final = 16
# Characters that one reads at once.
LONGEST: Final = 160


def signature_of(thing: Any) -> str:
    """The signature of a function or class.

    Types stand in the text. A class that the library alone makes has none. What does not fit into
    `LONGEST` characters is left to the list of parameters.
    """
    if thing.__name__ in MADE:
        return ""
    signature = inspect.signature(thing)
    kept = [_plain(one) for one in signature.parameters.values() if one.name not in ("self", "cls")]
    whole = signature.replace(parameters=kept)
    if len(_text(whole)) <= LONGEST:
        return _text(whole)
    while len(shown := _cut(signature.replace(parameters=kept))) > LONGEST:
        kept.pop()
    return shown


def _plain(one: inspect.Parameter) -> inspect.Parameter:
    default = one.default
    if default is not one.empty and len(repr(default)) > _LONGEST_DEFAULT:
        default = Ellipsis
    return one.replace(annotation=one.empty, default=default)


def _text(signature: inspect.Signature) -> str:
    return str(signature.replace(return_annotation=signature.empty)).replace("=Ellipsis", "=...")


def _cut(signature: inspect.Signature) -> str:
    return f"{_text(signature).removesuffix(')')}, ...)"
