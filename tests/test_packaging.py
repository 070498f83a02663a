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


def test_no_file_of_the_package_stands_twice():
    # The check of the wheel, which `make package` makes, refuses such files.
    paths = [path for path in (ROOT / "src").rglob("*") if path.is_file() and path.stat().st_size]
    contents = [path.read_bytes() for path in paths if path.suffix not in {".pyc", ".nbi", ".nbc"}]
    assert len(set(contents)) == len(contents)
