"""Bayesian inference on simulations: noise, likelihood, MAP fits, evidence, model search, latent forces."""
