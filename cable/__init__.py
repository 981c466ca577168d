"""The cable: a thin, flexible, growing line in water, pulled off a drum; it is independent of any vehicle.

Everything is SI, earth axes are north, east, down, positions are relative to the drum. The arc length s runs from
the tow point to the drum, the tangent t points that way, so V_t is negative while cable is pulled out.

symbol         name                                 unit      equation                           file
-------------  -----------------------------------  --------  ---------------------------------  -----------------------
T              tension                              N         (7), slack law T σ = T₀            moving_end/slack_law
t, d           tangent, chord of a segment          1, m      t = d/|d|                          moving_end/segment_load
V, U           velocity, and relative to the water  m/s       U = V − J                          moving_end/segment_load
p              momentum per length                  kg/s      p = m V + ρA (V − J)_⊥             moving_end/segment_load
m, m1          mass, with added mass, per length    kg/m      m1 = m + ρA                        properties
w_c            weight in water per length           N/m       (m − ρA) g                         properties
e              compliance 1/(E A)                   1/N       strain e T                         properties
C_t, C_n       drag coefficients                    1         ½ρπdC_t U_t|U_t|, ½ρdC_n U_⊥|U_⊥|  properties
S              length in the water                  m         dS/dt = −V_t(S), (14)-(19)         moving_end/state
R_d, I_d, C_f  drum: radius, inertia, friction      m …       (11)                               drum
F_c            force on the vehicle                 N         (12), f_1 − ½Q_1                   moving_end/assembly
α, β           angles of the paper's local frame    rad       (3)-(4)                            feng_allen/equation7

What a user calls stands here: `pull_out`, `tow` and `hold`, what they take (`properties`, `sections`, `sea_bed`,
`clamps`, `drum`, `winch`, `current`, `waves`, `schemes`) and give (`history`); and `tether.Tether`, which another
simulator steps, in the default formulation. A call makes a `task` of it, which one of three formulations computes; they
share nothing else:

* `moving_end`, the default: balances are vectors (their equivalence with the paper's six scalar equations, whose signs
  are derived again, is in `feng_allen.equation7` and tested), time is differenced backward, and a step is solved by
  Newton's method on a block tridiagonal system.
* `lumped`: masses and stiff springs, another time scheme.
* `feng_allen`: the paper's angles, in its own scheme (20)-(26) as printed, and in a box scheme of second order.
"""

from cable.clamps import Clamps
from cable.current import Current
from cable.drum import DrumProperties
from cable.history import Equilibrium, History, Outcome
from cable.hold import HoldError, hold
from cable.modes import Modes
from cable.moordyn_deck import Deck, DeckLine, read_deck
from cable.properties import CableProperties
from cable.pull_out import SCHEMES, pull_out, tow
from cable.schemes import Equation7, Lumped, MovingEnd, Paper
from cable.sea_bed import SeaBed
from cable.sections import Body, Section, SectionedCable, line_type, line_types
from cable.task import MovingDrum
from cable.tether import Tether, TetherError, TetherState
from cable.waves import Motion, VesselResponse, Waves
from cable.winch import Brake, ConstantTension, PayOutRate

__all__ = [
    "SCHEMES",
    "Body",
    "Brake",
    "CableProperties",
    "Clamps",
    "ConstantTension",
    "Current",
    "Deck",
    "DeckLine",
    "DrumProperties",
    "Equation7",
    "Equilibrium",
    "History",
    "HoldError",
    "Lumped",
    "Modes",
    "Motion",
    "MovingDrum",
    "MovingEnd",
    "Outcome",
    "Paper",
    "PayOutRate",
    "SeaBed",
    "Section",
    "SectionedCable",
    "Tether",
    "TetherError",
    "TetherState",
    "VesselResponse",
    "Waves",
    "hold",
    "line_type",
    "line_types",
    "pull_out",
    "read_deck",
    "tow",
]
