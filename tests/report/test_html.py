"""Pages from templates."""

import pytest
from jinja2 import UndefinedError

from sagnac.report.sections import rendered


def test_a_template_without_its_values_is_an_error():
    with pytest.raises(UndefinedError):
        rendered("comparison.html", title="a page")
