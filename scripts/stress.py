#!/usr/bin/env python3
"""Stiff, extreme and random scenes with every method: scripts/contactbench/stress.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("stress")
