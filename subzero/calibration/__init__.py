"""Estimate many numbers of a vehicle at once, from several records and manoeuvres, and write the vehicle they make.

    z* = argmin ½ Σ_records |W (y − h(z))|² + ½ zᵀ D⁻¹ z,      M = (D⁻¹ + Jᵀ J)⁻¹

z are deviations of the numbers that are free (`numbers`), with wide priors from the ranges of the vehicle's file, and
of everything else that records feel, within its tolerance: sensors, clock, current, cable, start. Simulation, fit and
noise are those of a diagnosis (`subzero.diagnosis.inference`). `fit` makes z* and M, `assessment` says what the
records do not determine, what to fly, and how well a record is predicted that was not fitted; `vehicle_file` writes it.
"""
