"""Measured records, read and checked (`record`) and compared with a run (`goodness_of_fit`); headings (`heading`)."""
