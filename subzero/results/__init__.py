"""The results of a run, as values and as files.

dataset       the labelled result of a run (`xarray.Dataset`), units and meanings with it
summary       its key figures, as in ``summary.json``
tables        those figures as tables of text
netcdf_csv    netCDF and CSV files of a run
export        a run for other programs: MCAP, MATLAB, Parquet, CF netCDF
"""
