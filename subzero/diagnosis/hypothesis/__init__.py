"""What may be wrong: effects with prior variances, the configuration that they edit, and sets of them."""
