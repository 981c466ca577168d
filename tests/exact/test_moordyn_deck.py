"""MoorDyn v2 decks: what is read, what is said to be left out, and what is refused.

Verifies: a chain on a floor, read from a deck, pulls as MoorPy says (22.924 N, `Catenary.catenary` with friction 0.3
and g = 9.81 m/s²; tolerance 0.1 %); two lines at a free point are one line of sections, whichever way they are written;
messages. Further down: range graphs of a cable at rest, against the catenary.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
from subzero.cli.app import main
from subzero.errors import UserError

DECK = """--------------------- MoorDyn Input File ---------------------
A chain on a floor, and a line of two sections with a clump
---------------------- LINE TYPES ----------------------
TypeName   Diam    MassDen     EA         BA/-zeta    EI         Cd     Ca     CdAx    CaAx
(name)     (m)     (kg/m)     (N)        (N-s/-)     (N-m^2)    (-)    (-)    (-)     (-)
chain      0.0036541 0.0818   1.0e4      0.0         0          1.5    3.8    0.1     0.0
rope       0.01      0.1      1.0e5      -0.8        2.0        1.2    1.0    0.01    0.5
---------------------- POINTS ----------------------
ID    Type      X       Y       Z       Mass   Volume  CdA    Ca
(#)   (-)       (m)     (m)     (m)     (kg)   (m^3)   (m^2)  (-)
1     Fixed     0       0       -3.0    0      0       0      0
2     Coupled   32.554  0        0.3    0      0       0      0
3     Free      10      2.0     -3.0    1.5    1e-4    0      0
4     Fixed     0       9.0     -3.0    0      0       0      0
5     Vessel    14.0    9.0      0.0    0      0       0      0
---------------------- LINES ----------------------
ID    LineType   AttachA  AttachB  UnstrLen  NumSegs  Outputs
(#)   (name)      (#)      (#)       (m)       (-)     (-)
1     chain       1        2        33.0      82       -
2     rope        3        5        6.0       30       -
3     chain       3        4        9.0       20       -
---------------------- OPTIONS ----------------------
1e-4    dtM
3.0e9   kBot
3e5     cBot
3.0     WtrDpth      # depth of the floor
1000.0  rhoW
0.3     FrictionCoefficient
1       WaveKin
---------------------- OUTPUTS ----------------------
FairTen1
--------------------- need this line ------------------
"""


def at_rest(line):
    return cable.hold(
        line.ends, line.length, cable=line.cable, segment_length=line.segment_length, bed=line.bed
    )


@pytest.mark.long
def test_a_chain_on_a_floor_pulls_as_moorpy_says():
    line = at_rest(cable.read_deck(DECK).lines[0])
    assert np.linalg.norm(line.tow_force) == pytest.approx(22.924, rel=1e-3)


@pytest.mark.long
def test_lines_at_a_free_point_are_one_of_sections_from_its_upper_end():
    line = cable.read_deck(DECK).lines[1]
    assert line.name == "2+3"
    assert [section.length for section in line.cable.sections] == [6.0, 9.0]
    assert [(body.place, body.mass, body.volume) for body in line.cable.bodies] == [(6.0, 1.5, 1e-4)]
    assert_allclose(line.ends, [(14.0, -9.0, 0.0), (0.0, -9.0, 3.0)])
    turned = cable.read_deck(DECK.replace("rope        3        5", "rope        5        3")).lines[1]
    assert_allclose(at_rest(turned).shape, at_rest(line).shape, atol=1e-9)


def test_what_is_not_computed_is_said():
    left_out = " ".join(cable.read_deck(DECK).left_out)
    for words in ("WaveKin = 1", "EI of line type rope", "damping ratio"):
        assert words in left_out


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("rhoW", "rhoWater", "Line 27 of the deck: there is no option 'rhoWater'. Did you mean 'rhoW'"),
        ("- LINES -", "- LINSE -", "there is no table 'LINSE'. Did you mean 'LINES'"),
        ("1     chain ", "1     chian ", "there is no line type 'chian'. Did you mean 'chain'"),
        ("1        2        33.0", "1        7        33.0", "there is no point '7'"),
        ("33.0      82", "long      82", "LENGTH is 'long'; it must be a finite number"),
        (
            "2     Coupled",
            "2     Cuopled",
            "a point of type 'CUOPLED' is neither held nor free. Did you",
        ),
        ("1        2        33.0", "1        3        33.0", "Point 3 of the deck is free and has 3 lines"),
        (DECK, "nothing", "no line between two held points"),
    ],
)
def test_what_makes_no_sense_is_refused(old, new, words):
    with pytest.raises(UserError, match=words.replace("'", ".")):
        cable.read_deck(DECK.replace(old, new, 1))


@pytest.mark.long
def test_the_command_shows_the_lines_and_what_is_left_out(tmp_path, capsys):
    path = tmp_path / "mooring.txt"
    path.write_text(DECK, encoding="utf-8")
    assert main(["import-line", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "22.9" in shown
    assert "left out: WaveKin = 1" in shown


def test_range_graphs_are_those_of_a_catenary():
    """κ = a/(a² + x²) with a = H/w at x from the lowest point; second order in 200 segments."""
    cord = cable.CableProperties(mass_per_length=0.02)
    rest = cable.hold([(9.0, 0.0, 0.0), (0.0, 0.0, 0.0)], 10.0, cable=cord, segment_length=0.05)
    run = rest.to_dataset()
    a = -rest.tow_force[0] / cord.weight_in_water
    s = run["arc_length"].values - 5.0
    assert_allclose(run["curvature"].values[1:-1], (a / (a**2 + s**2))[1:-1], rtol=1e-3)
    assert_allclose(run["declination"].values[1:-1], -np.arctan(s / a)[1:-1], atol=1e-3)
    assert_allclose(run["tension"].values, np.hypot(rest.tow_force[0], cord.weight_in_water * s), rtol=1e-3)
    assert len(rest.plot().axes) == 4
