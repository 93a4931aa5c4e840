#!/usr/bin/env python3
"""Every solver over every stored problem: scripts/contactbench/solve_all.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("solve_all")
