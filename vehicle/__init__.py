"""The vehicle: a rigid hull in water with propeller, linked rudders and two stern-planes; independent of any cable.

Everything is SI. Body axes point forward, to starboard and down from the hull centre; earth axes north, east,
down. Signs: positive rudder turns the heading to starboard (increasing), positive stern-plane (both) pitches
the nose up, starboard plane above port plane rolls to starboard; depth is positive down, heading counts
clockwise from north. A vehicle (`Vehicle`, from a file through `from_mapping`) gives `numbers()`, which the
compiled equations take: `derivative`, `breakdown`, `power`, and so on.

symbol         name                                  unit        equation                      file
-------------  ------------------------------------  ----------  ----------------------------  ------------
η, q           position, attitude quaternion         m, 1        η' = J ν                      kinematics
φ, θ, ψ        roll, pitch, heading                  rad         Euler angles, outside only    kinematics
ν              u, v, w, p, q, r over ground          m/s, rad/s  M ν' = Σ terms                dynamics
ν_r            the same through the water            m/s, rad/s  ν − (R_nbᵀ v_c, 0)            terms
M_RB, r_G      mass matrix, centre of gravity        kg, m       Fossen 3.47                   rigid_body
M_A, A_ij      added mass                            kg, kg m2   Lamb, strips                  rigid_body
C(ν)           Coriolis matrix of a mass matrix                  Kirchhoff                     rigid_body
W, B, r_B      weight, buoyancy and its centre       N, m        (r_G W − r_B B) × k           restoring
Y_uv, N_ur …   lift of the hull per surge speed      kg/m …      Y_uv |u| v + …                body_lift
C_d            cross-flow drag coefficient           1           −½ρ C_d 2R |V| V dx           cross_flow
C_D            axial drag coefficient                1           −½ρ(π/4)D² C_D u|u|           damping
K_p, Y_vv …    further damping                       kg m2/s …   D ν, D ν|ν|                   damping
n, T, Q        shaft speed, thrust, torque           rev/s, N    ρD⁴ K_T(J) n², ρD⁵ K_Q(J) n²  propeller
w, t           wake fraction, thrust deduction       1           u_a = (1 − w) u, (1 − t) T    propeller
C_L, C_D, α_s  lift, drag and stall of a fin         1, rad      attached, stalled, blended    fins, fin_list
T, d           thrust and direction of a thruster    N, 1        T_max c^e                     thrusters
V              volume of a buoyancy engine           m3          ρ g V                         buoyancy_engine
r, ΔM          a moving mass, change of mass matrix  m           (M + ΔM) ν' = …               moving_mass
K_D, K_α, …    drag and lift of a glider, per V²     kg/m        flow axes                     body_lift
δ_r, δ_s       rudder, stern-plane angle             rad         lag, limits, backlash         actuators
V, I, q_e      voltage, current, charge drawn        V, A, C     V_full − k q_e − R I          motor
"""

from vehicle.actuators import Servo
from vehicle.body_lift import FlowAxes
from vehicle.buoyancy_engine import BuoyancyEngine
from vehicle.channels import Channel
from vehicle.dynamics import (
    POWERS,
    battery_voltage,
    breakdown,
    breakdown_table,
    deflections,
    derivative,
    derivative_and_power,
    finish_step,
    kinetic_energy,
    potential_energy,
    power,
    relative_velocity,
)
from vehicle.fin_list import Fin
from vehicle.free_run import FreeRun, free_run
from vehicle.kinematics import euler_angles, initial_state, normalise, quaternion_from_euler, rotation
from vehicle.moving_mass import MovingMass
from vehicle.parameters import Problem, VehicleError
from vehicle.state import STATE, STATE_SIZE
from vehicle.terms import BREAKDOWN, TERMS
from vehicle.thrusters import Thruster
from vehicle.vehicle import SECTIONS, Vehicle, VehicleNumbers, from_mapping, to_mapping

__all__ = [
    "BREAKDOWN",
    "POWERS",
    "SECTIONS",
    "STATE",
    "STATE_SIZE",
    "TERMS",
    "BuoyancyEngine",
    "Channel",
    "Fin",
    "FlowAxes",
    "FreeRun",
    "MovingMass",
    "Problem",
    "Servo",
    "Thruster",
    "Vehicle",
    "VehicleError",
    "VehicleNumbers",
    "battery_voltage",
    "breakdown",
    "breakdown_table",
    "deflections",
    "derivative",
    "derivative_and_power",
    "euler_angles",
    "finish_step",
    "free_run",
    "from_mapping",
    "initial_state",
    "kinetic_energy",
    "normalise",
    "potential_energy",
    "power",
    "quaternion_from_euler",
    "relative_velocity",
    "rotation",
    "to_mapping",
]
