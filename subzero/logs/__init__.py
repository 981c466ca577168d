"""Logs as loggers write them, imported as records.

`api` leads through: a table from a file (`files`, `text`, `table`), its times (`times`), what its columns are called
(`names`), what its values say of their units (`evidence`), which column is what (`mapping`), as a file that a user may
edit (`map_file`).
"""
