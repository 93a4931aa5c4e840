#!/usr/bin/env python3
"""A run to look at: scripts/contactbench/view.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("view")
