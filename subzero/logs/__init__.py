"""Logs as loggers write them, imported as records.

`api` leads through: a table from a file (`table`), its times (`times`), what its columns are called (`names`), what its
values say of their units (`evidence`), and the map of all that, which a user may edit (`mapping`).
"""
