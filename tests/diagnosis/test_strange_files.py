"""Numbers and words in the files of a diagnosis that nobody means: each is one message."""

from __future__ import annotations

import base64
import hashlib
import json
import zlib

import pytest

from subzero.cli.app import MISTAKE, main
from subzero.diagnosis import read_extended
from subzero.errors import UserError
from subzero.files.read_file import MEGABYTE
from subzero.records.metadata import read_metadata
from subzero.synthetic.sealed_answer import SEALED, Answer, reveal, seal

TERM = '[[missing_term]]\naxis = "X"\nfeature = "u"\ncoefficient = {}\n'
HISTORY = '[[missing_force]]\naxis = "X"\ntime_s = [0, 1]\nforce_N = [0, {}]\n'
EXTENDED = {
    '[effects."hull_drag@²"]\nshare = 0.1\n': "behind the @ stands when it begins, in seconds",
    '[effects."hull_drag@'
    + "9" * 400
    + '"]\nshare = 0.1\n': "behind the @ stands when it begins, in seconds",
    "[effects.hull_drag]\nshare = 1" + "0" * 400 + "\n": "which is not a finite number",
    "[effects.hull_drag]\nshare = 0x" + "f" * 9999 + "\n": "which is not a finite number",
    TERM.format("1" + "0" * 400): "which is not a finite number",
    TERM.format("1e300"): "which is not a finite number",
    TERM.format("1").replace(
        '"X"', "12:30:00"
    ): "axis is datetime.time(12, 30), which is not a text in quotes",
    TERM.format("1").replace('"u"', "[1]"): "feature is [1], which is not a text in quotes",
    HISTORY.format("1" + "0" * 400): "is not a list of numbers",
    HISTORY.format("1e200"): "is not a list of numbers",
    HISTORY.format("1").replace('"X"', "12:30:00"): "axis is datetime.time(12, 30). Allowed: X, Y",
    "scenario = 0x" + "f" * 9999 + "\n": "but this is not a text in quotes",
    HISTORY.format("1") * 101: "there are 101 of them; at most 100 are read",
}


@pytest.mark.parametrize("text", EXTENDED, ids=range(len(EXTENDED)))
def test_an_extended_model_that_nobody_means_is_refused(text, tmp_path):
    (tmp_path / "extended.toml").write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=r"^The extended model .* cannot be used:\n") as caught:
        read_extended(tmp_path / "extended.toml")
    assert EXTENDED[text] in str(caught.value)


SIDECARS = {
    "[noise]\nheading_deg = 1e-300\n": "found 1e-300. Allowed: 1e-06 to 1e+06",
    "[noise]\nheading_deg = 1e300\n": "found 1e+300. Allowed: 1e-06 to 1e+06",
    "[noise]\nheading_deg = 0x" + "f" * 9999 + "\n": "Allowed: 1e-06 to 1e+06",
    "[noise]\nheading_deg = 12:30:00\n": "this is not a number above 0",
    "[rate_hz]\nheading_deg = 1e300\n": "found 1e+300. Allowed: 0.0001 to 100000",
    "units_checked = [[1]]\n": "there is no column [1]",
    "units_checked = [{a = 1}]\n": "there is no column {'a': 1}",
    "surge_speed = 12:30:00\n": "this is not a text in quotes",
    'surge_speed = "\\u001b[31mred"\n': "found '\\x1b[31mred'. Allowed: 'water' or 'ground'",
}


@pytest.mark.parametrize("text", SIDECARS, ids=range(len(SIDECARS)))
def test_a_sidecar_that_nobody_means_is_refused(text, tmp_path):
    (tmp_path / "record.toml").write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=r"^The sidecar .* cannot be used:\n") as caught:
        read_metadata(tmp_path / "record.toml")
    assert SIDECARS[text] in str(caught.value)


def sealed(text: bytes) -> str:
    packed = base64.b64encode(zlib.compress(text, 9)).decode()
    return json.dumps({"sha256": hashlib.sha256(text).hexdigest(), "sealed": packed})


ANSWER = json.loads(json.dumps({"kind": "single", "names": ["a"], "sentences": ["It is."]}))
CHANGED = {
    "deep": "[" * 100_000,
    "a list": "[1, 2]",
    "deep inside": sealed(b"[" * 100_000 + b"]" * 100_000),
    "a bomb": sealed(b" " * (50 * MEGABYTE)),
    "no mapping": sealed(b"[1]"),
    "other keys": sealed(b'{"names": [], "sentences": [], "more": 1}'),
    "words that are none": sealed(json.dumps(ANSWER | {"names": 3}).encode()),
    "as many words as names": sealed(json.dumps(ANSWER | {"names": ["a", "b"]}).encode()),
    "no numbers": sealed(json.dumps(ANSWER | {"deviations": {"a": {"b": "c"}}}).encode()),
    "not finite": sealed(json.dumps(ANSWER | {"deviations": {"a": {"b": float("nan")}}}).encode()),
    "a seed that is too large": sealed(json.dumps(ANSWER | {"seed": 10**400}).encode()),
    "too large": sealed(json.dumps(ANSWER | {"deviations": {"a": {"b": 10**400}}}).encode()),
}


@pytest.mark.parametrize("what", CHANGED)
def test_a_sealed_answer_that_nobody_sealed_is_refused(what, tmp_path, capsys):
    (tmp_path / SEALED).write_text(CHANGED[what], encoding="utf-8")
    assert main(["challenge", "--reveal", str(tmp_path)]) == MISTAKE
    said = capsys.readouterr().err
    assert said.endswith("has been changed. Make the challenge again from its seed.\n")
    assert said.count("\n") == 1


def test_a_huge_sealed_answer_is_refused(tmp_path):
    (tmp_path / SEALED).write_text(" " * (2 * MEGABYTE), encoding="utf-8")
    with pytest.raises(UserError, match="it is larger than 1 MB, the most that is read"):
        reveal(tmp_path)


def test_control_characters_of_an_answer_are_shown_escaped(tmp_path):
    (tmp_path / SEALED).write_text(seal(Answer(kind="single", names=("a",), sentences=("\x1b[2J",))))
    assert str(reveal(tmp_path)) == "a: \\x1b[2J"


def test_a_key_that_does_not_print_is_shown_escaped(tmp_path):
    (tmp_path / "extended.toml").write_text('[effects."\\u001b[2J"]\nshare = 1\n')
    with pytest.raises(UserError, match=r"there is no effect '\\x1b\[2J'") as caught:
        read_extended(tmp_path / "extended.toml")
    assert str(caught.value).replace("\n", "").isprintable()
