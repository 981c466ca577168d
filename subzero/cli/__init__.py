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
examples            example lines of each command's help
output_mode         --quiet, --json, --verbose
progress            progress bars, also into a pipe
interrupts          Ctrl-C and SIGTERM
"""
