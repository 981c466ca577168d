"""From the explanations of a search to a verdict: terms in the words of a trial, estimates, the extended model."""
