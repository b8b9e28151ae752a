"""`python -m airground_drake COMMAND ...`."""

from airground_drake.commands import entry

if __name__ == "__main__":
    entry()
