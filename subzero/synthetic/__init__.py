"""Records with a known truth, made by the other cable formulation: to test a diagnosis, and to challenge a user."""
