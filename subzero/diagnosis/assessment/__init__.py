"""How good a fit is, what the records can show at all, and which trial would show more."""
