#!/usr/bin/env python3
"""The figure that this is called by the name of (the links in scripts/plots): scripts/contactbench/figures.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("figures")
