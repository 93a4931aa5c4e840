#!/usr/bin/env python3
"""Does the runs of sweep files: scripts/contactbench/sweep.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("sweep")
