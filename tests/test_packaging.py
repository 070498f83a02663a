"""The recipes of packages ask for what pyproject.toml asks for, in the version that there is."""

import re
import tomllib
from pathlib import Path

import yaml

import sagnac

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONDA = (ROOT / "conda" / "meta.yaml").read_text(encoding="utf-8")
# Names that differ there.
OF_CONDA = {"matplotlib-base": "matplotlib", "python-fastjsonschema": "fastjsonschema"}


def test_the_conda_recipe_asks_for_what_the_project_asks_for():
    recipe = yaml.safe_load(CONDA)
    run = [re.split(r"\s+", one) for one in recipe["requirements"]["run"]]
    wanted = {OF_CONDA.get(name, name) + limit for name, limit in run}
    assert wanted == {*PROJECT["dependencies"], f"python{PROJECT['requires-python']}"}
    assert recipe["package"]["version"] == sagnac.__version__
    (script,) = PROJECT["scripts"].items()
    assert recipe["build"]["entry_points"] == [" = ".join(script)]
    assert recipe["about"]["summary"] == PROJECT["description"]


def test_the_container_copies_what_there_is():
    text = (ROOT / "Containerfile").read_text(encoding="utf-8")
    for line in re.findall(r"^COPY (?!--from)(.*)$", text, re.M):
        for name in line.split()[:-1]:
            assert (ROOT / name).exists(), name
    for name in re.findall(r"-r (requirements/\S+)", text):
        assert (ROOT / name).is_file(), name
