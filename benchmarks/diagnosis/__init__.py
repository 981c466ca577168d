"""How often a diagnosis is right: `world_page` writes docs/diagnosis_world.md from what the other modules measured."""
