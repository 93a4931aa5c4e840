#!/usr/bin/env python3
"""Every solver over a frozen stream of problems: scripts/contactbench/replay.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("replay")
