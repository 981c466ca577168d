"""A vehicle on the paper's own scheme, as printed: imported, and compiled, only when a trial asks for it."""
