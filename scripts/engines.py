#!/usr/bin/env python3
"""Engines beside the methods: preflights, tuned knobs, tables. scripts/contactbench/engines.py."""
from contactbench import start

if __name__ == "__main__":
    start.command("engines")
