"""The rigid body in water."""
