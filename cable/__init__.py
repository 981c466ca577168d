"""The tether."""
