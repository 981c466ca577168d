"""Print the lowest version of every direct dependency that pyproject.toml allows, as pip takes it."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
print(*(dependency.replace(">=", "==") for dependency in project["dependencies"]))
