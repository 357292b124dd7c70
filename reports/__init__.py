"""What people look at: the report page, tables and figures for papers, contact sheets, tables in a terminal.

Imports all but `bench`, `prepared`, `comparison`, `rescoring` and the commands.
"""
