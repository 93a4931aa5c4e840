#!/usr/bin/env python3
"""Engines' own contact problems, and Siconos' solvers beside ours. scripts/contactbench/isolated.py."""
from contactbench import start

if __name__ == "__main__":
    start.command("isolated")
