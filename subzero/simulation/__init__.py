"""Run a trial: from a checked scenario and a model to labelled results.

run                one trial, or many of them in threads
stepper            `Simulator`: a run step by step, for a controller outside
comparison         the trial with its cable and without, and measured channels on the same axes
refinement         how much of the tow force is discretisation error: finer runs until it is small enough
checkpoint         a long run that goes on where it was killed
memory_estimate    how much memory a run takes, before it starts
feng_allen         the scheme of the paper, as printed
provenance         which versions, sources and settings a result was made with
"""
