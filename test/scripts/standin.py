"""A stand-in for the program, whose answers are known and which can be told to misbehave: FAKE='{"scene": "crash"}'."""
import os
import stat
import sys

# A shell starts in a tenth of the time that Python takes, and warming up, which is half of all starts, asks for nothing.
PROGRAM = """#!/bin/sh
''':'
case "$*" in *warm_up*) exit ;; esac
exec {python} -S "$0" "$@"
'''
import json, os, sys, time
words = sys.argv[1:]
SCENES = {scenes!r}
if words[0] == "list":
    method = lambda name, solvers, variants, flags: {{"name": name, "solvers": solvers, "variants": variants,
                                                      "options": [{{"flag": f}} for f in flags]}}
    print(json.dumps({{
        "methods": [method("newton", [], ["uncapped", "stick-tested"], []), method("mirtich", [], [], []),
                    method("ap", ["lemke", "path-lib", "pgs"], [], ["k"]),
                    method("convex", ["ipm"], [], ["epsilon", "compression-bound"])],
        "solvers": [{{"method": "ap", "name": "path-lib", "unavailable": "not installed"}},
                    {{"method": "ap", "name": "lemke", "unavailable": None}},
                    {{"method": "ap", "name": "pgs", "unavailable": None}},
                    {{"method": "convex", "name": "ipm", "unavailable": None}}],
        "scenarios": [{{"name": s + ".xml", "file": sys.argv[0], "parameters": p}} for s, p in SCENES.items()],
        "references": [],
        "engines": [{{"name": "ode", "unavailable": None, "variants": [{{"name": "quick"}}]}},
                    {{"name": "dart", "unavailable": "not installed"}}],
        "statuses": [{{"name": s, "summary": s}} for s in ("ok", "inaccurate", "nonconverged", "ray", "interrupted", "time_limit",
                                                            "memory_limit", "crash", "input_error")]}}))
    sys.exit()
if words[0] == "check":  # --files: as the program says it of a scene with a robot from a file beside it
    import pathlib
    print(words[1], *([robot] if (robot := pathlib.Path(words[1]).with_suffix(".urdf")).exists() else []), sep="\\n")
    sys.exit()
scene, out = words[1].rsplit("/")[-1].removesuffix(".xml"), words[words.index("--out") + 1]
flag = lambda name, default: words[words.index(name) + 1] if name in words else default
os.makedirs(out, exist_ok=True)
mode = json.loads(os.environ.get("FAKE", "{{}}")).get(scene, "")
if os.environ.get("LOG"):
    with open(os.environ["LOG"], "a") as log: log.write(" ".join(words[1:words.index("--out")]) + "\\n")
time.sleep(float(os.environ.get("SLOW", "0")))
n = 100
with open(out + "/trajectory.csv", "w") as f:
    f.write("t,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\\n")
    # mode "apart": every method goes its own way, and every step besides.
    way = 1e-8
    # mode "alike": ap and convex, 1 mm a second apart, go another way than the others.
    ways = {{"newton": 0, "mirtich": 1, "ap": 2, "convex": 3 if mode == "apart" else 2.001, "coulomb": 4}}
    if mode in ("apart", "alike"): way = ways[flag("--method", "")] + float(flag("--step", "0.001"))
    for i in range(n + 1): f.write(f"{{i / 10}},box,{{i / 10 * way}},0.5,0,1,0,0,0,0,0,0,0,0,0\\n")
    f.write("10.1,box,0.")  # what a killed program leaves
with open(out + "/steps.csv", "w") as f:
    f.write("step,t,status,residual,kinetic_energy,dynamics_s,collision_s,assembly_s,solve_s,step_s\\n")
    for i in range(n): f.write(f"{{i + 1}},{{(i + 1) / 10}},ok,,{{n - i}},1e-6,1e-6,1e-6,1e-6,1e-5\\n")
    f.write("101,10.")
if mode == "crash": os.abort()
if mode == "fault": raise RuntimeError("no such thing")
if mode == "refuse":
    sys.stderr.write("bad scene\\n")
    sys.exit(2)
if mode == "hang":
    while True: time.sleep(1)
if mode == "eat":
    hoard = []
    while True: hoard.append(bytearray(1 << 24))
early = (mode == "early" or not mode and scene == "stack" and flag("--set", "").endswith("16")) and "ap" in words
status = "ray" if early else mode if mode in ("inaccurate", "interrupted") else "ok"
finished = status in ("ok", "inaccurate")
summary = {{"scenario": scene, "method": flag("--method", flag("--engine", "")), "status": status, "reason": "no way on" if early else None,
            "finished": finished, "t_reached": 0.25,
            "options": {{"step": float(flag("--step", "0.001")), "duration": 10.0}}, "errors": {{"final_m": 1e-9}},
            "time": {{"total_s": 1, "dynamics_s": 0.25, "collision_s": 0.125, "assembly_s": 0.0625, "solve_s": 0.0625}},
            "peak_memory_mb": 12.0, "residuals": {{"max": None, "law_max": None}}, "versions": {{"git": "abc"}}, "machine": {{"cores": 2}}}}
if mode == "error":
    # The error falls with the step; what is dearer errs less.
    cost, share = {{"newton": (0.1, 10), "mirtich": (0.2, 5), "ap": (0.3, 2), "convex": (0.4, 1), "coulomb": (0.5, 1), "ode": (0.05, 4)}}[summary["method"]]
    step = summary["options"]["step"]
    summary["errors"]["position_linf_m"], summary["time"]["dynamics_s"] = share * step, cost * 1e-3 / step
    summary["reference"] = {{"kind": "analytic"}}
    summary["steps"], summary["residuals"] = round(10 / step), {{"false_claims": 0, "law_max": 0.0}}
if mode == "chaos":
    # The error follows the seed of the member; half of the members gain energy.
    seed = int(flag("--seed", "0"))
    summary["errors"]["position_linf_m"] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6][seed]
    summary["errors"]["energy_rise_relative"] = 0.1 * (seed % 2)
    summary["reference"], summary["steps"], summary["residuals"] = {{"kind": "analytic"}}, 100, {{"false_claims": 0, "law_max": 0.0}}
if mode in ("apart", "alike"): summary["residuals"], summary["steps"] = {{"false_claims": 0, "law_max": 0.0}}, 100
if mode == "nan": summary["errors"]["final_m"] = float("nan")
if mode == "liar": summary["finished"] = False
text = json.dumps(summary)
if mode == "garbage": text = "\\x00\\xff\\x80" * 1000
if mode == "cut": text = text[:100]
if mode == "spew":
    for i in range(300): sys.stderr.write("x" * 100000 + "\\n")
if mode != "silent":
    with open(out + "/summary.json", "w") as f: f.write(text)
if mode == "late": os.abort()
sys.exit(0 if finished else 3)
"""

SCENES = {"impacting_sphere": {}, "sliding_box": {"rotate_cone": "0"}, "sticking_box": {}, "circular_sliding": {"start": "steady"},
          "stack": {"boxes": "16"}}


def write(path):
    path.write_text(PROGRAM.format(python=sys.executable, scenes=SCENES))
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def environment(**more):
    return {**os.environ, "FAKE": "{}", **more}


def leaves(tree, path=()):
    """(path, leaf) of all that JSON holds."""
    if isinstance(tree, (dict, list)):
        for key, part in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from leaves(part, (*path, key))
    else:
        yield path, tree
