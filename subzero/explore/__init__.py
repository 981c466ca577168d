"""`subzero explore`: a live page with sliders, on this machine only.

exploration     the trial, its sliders and their effects: values only
page            the page in the browser
local_access    who may open it
"""
