"""A verdict in words, tables, HTML, JSON and TOML."""
