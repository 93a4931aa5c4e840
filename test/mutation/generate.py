"""Draws faults mechanically: an operator or a constant of the sources is exchanged, wherever chance has it.

Comments, strings, includes, and the text of messages are left alone. The same seed draws the same faults of the same tree.
"""
import hashlib
import random
import re

# What is looked for (with the characters that must stand beside it), and what takes its place.
EXCHANGES = [
    (re.compile(r"(?<=\s)<=(?=\s)"), "<"),
    (re.compile(r"(?<=\s)>=(?=\s)"), ">"),
    (re.compile(r"(?<=[\w\])] )<(?= [\w(*&-])"), ">="),
    (re.compile(r"(?<=[\w\])] )>(?= [\w(*&-])"), "<="),
    (re.compile(r"(?<=\s)\+(?=\s)"), "-"),
    (re.compile(r"(?<=[\w\])] )-(?=\s)"), "+"),
    (re.compile(r"(?<=[\w\])] )\*(?= [\w(])"), "/"),
    (re.compile(r"(?<=\s)/(?=\s)"), "*"),
    (re.compile(r"(?<=\s)\+=(?=\s)"), "-="),
    (re.compile(r"(?<=\s)-=(?=\s)"), "+="),
    (re.compile(r"(?<=\s)&&(?=\s)"), "||"),
    (re.compile(r"(?<=\s)\|\|(?=\s)"), "&&"),
    (re.compile(r"(?<=\s)==(?=\s)"), "!="),
    (re.compile(r"(?<=\s)!=(?=\s)"), "=="),
    (re.compile(r"\bstd::max\("), "std::min("),
    (re.compile(r"\bstd::min\("), "std::max("),
    (re.compile(r"\bcwiseMax\("), "cwiseMin("),
    (re.compile(r"\btrue\b"), "false"),
    (re.compile(r"\bfalse\b"), "true"),
    (re.compile(r"\bstd::sin\("), "std::cos("),
    (re.compile(r"(?<=return )-(?=\w)"), ""),
    (re.compile(r"(?<=[(=,] )-(?=[a-z])"), ""),
    (re.compile(r"\b\d+(?:\.\d*)?e-\d+\b"), None),        # a tolerance: a thousand times larger
    (re.compile(r"(?<=[\s(])0\.\d+(?=[\s;,)])"), None),   # a factor: half of it
    (re.compile(r"(?<= )[123](?= [*+-] )|(?<=[*+-] )[123](?=[;,) ])"), None),  # a small number: one more
]
SKIPPED = re.compile(r'//.*|/\*.*?\*/|"(?:\\.|[^"\\])*"|#\s*include.*|\'(?:\\.|[^\'\\])\'', re.DOTALL)
PYTHON_SKIPPED = re.compile(r'""".*?"""|#.*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.DOTALL)


def other_number(text):
    if "e-" in text:
        return f"{float(text) * 1e3:g}"
    if "." in text:
        return f"{float(text) / 2:g}"
    return str(int(text) + 1)


def sites(text, python):
    """(offset, old, new) of everything that may be exchanged."""
    blanked = (PYTHON_SKIPPED if python else re.compile(SKIPPED.pattern.replace("//.*", "//[^\\n]*").replace("include.*", "include[^\\n]*"), re.DOTALL)).sub(
        lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    for pattern, new in EXCHANGES:
        for match in pattern.finditer(blanked):
            yield match.start(), match[0], new if new is not None else other_number(match[0])


def draw(root, files, count, seed):
    """`count` faults over lib, app and scripts, rooms in proportion to the places that they offer."""
    places = []
    for name in sorted(files):
        if not name.startswith(("lib/", "app/", "scripts/")) or not name.endswith((".cpp", ".h", ".py")) or "/plots/" in name:
            continue
        text = (root / name).read_text()
        places += [(name, text, *site) for site in sorted(sites(text, name.endswith(".py")))]
    chosen = random.Random(seed).sample(places, min(count, len(places)))
    out = []
    for name, text, offset, old, new in chosen:
        line = text.count("\n", 0, offset) + 1
        parts = name.split("/")
        mark = hashlib.sha256(f"{name}:{text[max(0, offset - 40):offset + 40]}:{new}".encode()).hexdigest()[:6]
        out.append({"id": f"drawn-{parts[-1].split('.')[0]}-{mark}", "file": name, "room": parts[1] if parts[0] == "lib" else parts[0],
                    "what": f"line {line}: {old} becomes {new or 'nothing'}", "from": old, "to": new, "offset": offset, "equivalent": ""})
    return out
