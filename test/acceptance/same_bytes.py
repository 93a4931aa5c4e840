#!/usr/bin/env python3
"""The same numbers on every machine: the same runs as other processors would do them, and as other builds do.

usage: same_bytes.py PROGRAM [--other PROGRAM]... [--only TEXT] [--processors NAME,...] [--short]

Each run is done as this machine does it, and then in other ways; what it writes must be the same bytes, but for times, memory, paths,
and what names the machine or the build (docs/performance.md, "The same numbers on every machine").
  address       where memory lies: drawn anew at each start
  libm          without what glibc picks its kernels by beyond the program's own level (AVX-512; strings and copies too)
  blas ...      OpenBLAS in place of the system's BLAS, told that this is one processor or another (libopenblas0-pthread): no BLAS is called
  NAME          an emulated processor: qemu-x86_64 -cpu NAME, where qemu-user is installed
  --other       another build of the same level, as with other -mtune=
A way that asks less than the program's level is none: the program refuses such a processor, which is looked at too.
--short: ctest runs that part, without emulated processors but one. Exits 1 where bytes differ, a run wrote nothing, or nothing was run.
"""
import argparse
import csv
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# Scene, parameters and flags: the five scenes of free bodies and the robots of the paper, long enough for impact, slip and rest.
SCENES = [
    ("impacting_sphere", {}, ["--duration", "0.6"]), ("sliding_box", {}, ["--duration", "0.5"]), ("sticking_box", {}, ["--duration", "0.1"]),
    ("circular_sliding", {}, ["--duration", "0.5"]), ("stack", {"boxes": "4"}, ["--duration", "0.05"]),
    ("mobile_robot", {}, ["--duration", "0.05"]), ("grasp", {}, ["--duration", "0.05"]),
]
SHORT = ("sliding_box", "stack", "mobile_robot")
METHODS = [
    ["--method", "newton"], ["--method", "mirtich"], ["--method", "convex"],
    ["--method", "ap", "--solver", "lemke"], ["--method", "ap", "--solver", "path"], ["--method", "ap", "--solver", "ynl"],
    ["--method", "coulomb", "--solver", "newton"], ["--method", "coulomb", "--solver", "admm"], ["--method", "soft"],
]
# Intel's and AMD's processors of x86-64-v3: other caches, other makers, other kernels in the libraries.
PROCESSORS = ["Haswell-noTSX", "Skylake-Client-noTSX-IBRS", "EPYC", "EPYC-Milan"]
TOO_OLD = "Nehalem"
BLAS_KERNELS = ["Prescott", "Haswell"]
BEYOND = "AVX512F,-AVX512VL,-AVX512BW,-AVX512DQ,-AVX512CD,-AVX_VNNI,-ERMS,-FSRM,-Prefer_No_VZEROUPPER"
# Of summary.json: what names the machine, the build, the input's path and the way, or is measured.
APART = {"time", "peak_memory_mb", "machine", "versions", "file"}
PATIENCE = 600  # s, for a run


def bytes_of(folder):
    """What a run wrote, without what may differ: text by file."""
    written = {}
    for path in sorted(folder.iterdir()):
        if path.suffix == ".csv":
            rows = list(csv.reader(path.open(newline="")))
            keep = [i for i, name in enumerate(rows[0]) if not name.endswith("_s")]
            written[path.name] = "\n".join(",".join(row[i] for i in keep if i < len(row)) for row in rows)
        elif path.name == "summary.json":
            written[path.name] = "\n".join(plain(json.loads(path.read_text())))
    return written


def plain(value, name=""):
    """A line a number or text of a summary."""
    if isinstance(value, dict):
        for key, part in value.items():
            if key not in APART and not key.endswith("_s"):
                yield from plain(part, f"{name}.{key}")
    elif isinstance(value, list):
        for index, part in enumerate(value):
            yield from plain(part, f"{name}.{index}")
    else:
        yield f"{name} {value!r}"


def first_difference(a, b):
    """Where two runs differ first; empty where nowhere."""
    for name in sorted(set(a) | set(b)):
        ours, theirs = a.get(name, "").split("\n"), b.get(name, "").split("\n")
        for line, (x, y) in enumerate(zip(ours, theirs)):
            if x != y:
                return f"{name}, line {line + 1}: {x[:160]} | {y[:160]}"
        if len(ours) != len(theirs):
            return f"{name}: {len(ours)} lines, {len(theirs)} lines"
    return ""


def run(program, scene, parameters, flags, method, prefix=(), env=()):
    """What the run wrote; its status stands in there."""
    sets = [part for pair in parameters.items() for part in ("--set", "=".join(pair))]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [*prefix, program, "run", scene, *sets, *flags, *method, "--quiet", "--out", str(out)]
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **dict(env)}, timeout=PATIENCE, cwd=folder)
        if not out.is_dir():
            return {"nothing": f"exit code {done.returncode}: {done.stderr.strip()[-300:]}"}
        return bytes_of(out)


def openblas():
    """Environments in which the program finds OpenBLAS, by the kernels that it picks."""
    folder = Path(f"/usr/lib/{platform.machine()}-linux-gnu/openblas-pthread")
    if not (folder / "libblas.so.3").exists():
        print("OpenBLAS is not installed (libopenblas0-pthread): no other BLAS")
        return {}
    return {f"blas {kernels}": {"LD_LIBRARY_PATH": str(folder), "OPENBLAS_CORETYPE": kernels} for kernels in BLAS_KERNELS}


def ways(options):
    """Name, program, what stands before it, environment."""
    out = [("address", options.program, (), {}), *((name, options.program, (), env) for name, env in openblas().items())]
    if platform.machine() == "x86_64":
        out.append(("libm", options.program, (), {"GLIBC_TUNABLES": f"glibc.cpu.hwcaps=-{BEYOND}"}))
        if qemu := shutil.which("qemu-x86_64"):
            out += [(name, options.program, (qemu, "-cpu", name), {}) for name in options.processors]
        else:
            print("qemu-x86_64 is not installed (qemu-user): no other processors")
    return out + [(str(other), other, (), {}) for other in options.other]


def refuses(program):
    """What is wrong with how the program meets a processor below its level; None where it cannot be asked."""
    qemu = shutil.which("qemu-x86_64")
    level = subprocess.run([program, "--version"], capture_output=True, text=True).stdout
    if not qemu or "-march=x86-64-v" not in level:
        return None
    done = subprocess.run([qemu, "-cpu", TOO_OLD, program, "--version"], capture_output=True, text=True)
    said = done.stderr.strip().splitlines()
    return "" if done.returncode == 1 and said and "compiled for" in said[-1] else f"exit code {done.returncode}, {done.stderr.strip()[-300:]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("program")
    parser.add_argument("--other", action="append", default=[])
    parser.add_argument("--only", default="")
    parser.add_argument("--processors", type=lambda text: text.split(","), default=None)
    parser.add_argument("--short", action="store_true")
    options = parser.parse_args()
    options.program, options.other = str(Path(options.program).resolve()), [str(Path(p).resolve()) for p in options.other]
    options.processors = options.processors or (PROCESSORS[:1] if options.short else PROCESSORS)
    listed = ways(options)
    same, bad = {}, []
    for scene, parameters, flags in SCENES:
        if options.short and scene not in SHORT:
            continue
        for method in METHODS:
            name = " ".join([scene, *("=".join(p) for p in parameters.items()), *method[1::2]])
            if options.only not in name:
                continue
            here = run(options.program, scene, parameters, flags, method)
            for way, program, prefix, env in listed:
                there = run(program, scene, parameters, flags, method, prefix, env)
                # Two that wrote nothing are alike, and show nothing.
                found = here.get("nothing") or there.get("nothing") or first_difference(here, there)
                if found:
                    bad.append((way, name))
                    print(f"differs: {way}: {name}: {found}", flush=True)
                else:
                    same[way] = same.get(way, 0) + 1
    for way, count in same.items():
        print(f"{way}: {count} runs the same, {sum(w == way for w, _ in bad)} not")
    if (wrong := refuses(options.program)) is not None:
        print(f"{TOO_OLD}: " + (wrong or "refused with one message"))
        if wrong:
            bad.append((TOO_OLD, wrong))
    if not same and not bad:
        print("nothing was compared")
    return 1 if bad or not same else 0


if __name__ == "__main__":
    sys.exit(main())
