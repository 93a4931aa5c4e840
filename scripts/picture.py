#!/usr/bin/env python3
"""A first picture of a scene: scripts/contactbench/picture.py."""
from contactbench import start

if __name__ == "__main__":  # other processes import this to take part
    start.command("picture")
