"""The command line: one module per command.

A command module holds one function named ``command`` whose signature is the command's arguments and options
(typer) and whose docstring is its help; it imports nothing heavy at its top, so that ``cadskin --help`` stays
quick. Its name is entered once, in `cadskin.cli.main.COMMANDS`. Everything that goes wrong is raised as a
`cadskin.errors.CadskinError`; `cadskin.cli.main` alone turns errors into a line and an exit code.
"""
