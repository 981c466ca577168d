"""The command line: one module per group of commands, and the modules that print and write their results.

app                 `main`; simulate, compare, plot, explore
trials              list, show, new
install             doctor, warm, completion
import_log          import
cables              export-fmu, import-line
autopilot           manoeuvre, autopilot                     write_flights        their files
sweep               sweep                                    write_sweep          its files
diagnosis           diagnose, calibrate, challenge           write_diagnosis, write_calibration
write_results       files, figures and page of simulate and compare
output_mode         --quiet, --json, --verbose
progress            progress bars, also into a pipe
interrupts          Ctrl-C and SIGTERM
"""

EXAMPLES = {
    "list": ("subzero list", "subzero list --vehicles --cables"),
    "new": (
        "subzero new my_trial.toml",
        "subzero new auv.toml --torpedo length=2.0 diameter=0.2 mass=45 speed=1.8",
    ),
    "show": ("subzero show fig6", "subzero show subzero2"),
    "validate": ("subzero validate my_trial.toml", "subzero validate record.csv"),
    "simulate": ("subzero simulate fig6", "subzero simulate my_trial.toml --untethered --out here"),
    "compare": ("subzero compare fig6", "subzero compare fig6 --measured record.csv --json"),
    "plot": (
        "subzero plot fig6/tethered.nc --what tension shape3d",
        "subzero plot fig6/tethered.nc --what heading --format svg",
    ),
    "explore": ("subzero explore fig6", "subzero explore my_trial.toml --port 9000 --no-browser"),
    "manoeuvre": (
        "subzero manoeuvre zigzag",
        "subzero manoeuvre turning_circle --vehicle remus100 --rudder 10",
    ),
    "autopilot": (
        "subzero autopilot heading_step",
        "subzero autopilot depth_step fig6 --autopilot lqr --feed-forward model",
    ),
    "import": ("subzero import log.csv --out record.csv", "subzero import log.csv --map map.toml"),
    "diagnose": (
        "subzero diagnose fig6 record.csv --out found",
        "subzero diagnose hidden --scenario fig6 --screen",
    ),
    "calibrate": (
        "subzero calibrate zigzag.csv dive.csv --scenario fig6 --out my_vehicle.toml",
        "subzero calibrate flown --free rudder.lift_slope rudder_servo.lag --quick",
    ),
    "challenge": ("subzero challenge fig6 --seed 38 --out hidden", "subzero challenge --reveal hidden"),
    "sweep": ("subzero sweep cable_and_current.toml",),
    "export-fmu": (
        "subzero export-fmu --length 30",
        "subzero export-fmu rov_umbilical --length 60 --longest 200 --out umbilical.fmu",
    ),
    "import-line": ("subzero import-line mooring.txt",),
    "doctor": ("subzero doctor",),
    "warm": ("subzero warm",),
    "completion": ("subzero completion bash > ~/.local/share/bash-completion/completions/subzero",),
}
"""Name of a command → examples, lines of the shell below its help; a test parses each."""
