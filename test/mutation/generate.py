"""Draws faults mechanically: an operator or a constant of the sources is exchanged, a term or a check left out, wherever
chance has it.

Comments, strings, includes, and the text of messages are left alone. A place's lot is the hash of the seed and of the text
around it, and those with the least lots of each room are drawn: a change elsewhere in the tree leaves them as they are.
"""
import collections
import hashlib
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
    (re.compile(r"(?<=[\w)] )and(?= )"), "or"),
    (re.compile(r"(?<=[\w)] )or(?= )"), "and"),
    (re.compile(r"(?<=\s)==(?=\s)"), "!="),
    (re.compile(r"(?<=\s)!=(?=\s)"), "=="),
    (re.compile(r"\bstd::max\("), "std::min("),
    (re.compile(r"\bstd::min\("), "std::max("),
    (re.compile(r"(?<=[ (])max\("), "min("),
    (re.compile(r"(?<=[ (])min\("), "max("),
    (re.compile(r"\bcwiseMax\("), "cwiseMin("),
    (re.compile(r"\btrue\b"), "false"),
    (re.compile(r"\bfalse\b"), "true"),
    (re.compile(r"\bstd::sin\("), "std::cos("),
    (re.compile(r"(?<=return )-(?=\w)"), ""),
    (re.compile(r"(?<=[(=,] )-(?=[a-z])"), ""),
    (re.compile(r"\b\d+(?:\.\d*)?e-\d+\b"), None),        # a tolerance: a thousand times larger
    (re.compile(r"(?<=[\s(])0\.\d+(?=[\s;,)])"), None),   # a factor: half of it
    (re.compile(r"(?<= )[123](?= [*+-] )|(?<=[*+-] )[123](?=[;,) ])"), None),  # a small number: one more
    (re.compile(r"(?<=\n)[ ]+[\w.>\[\]-]+ [+-]= [^;{}\n]*;"), ""),                                # a term left out
    (re.compile(r"(?<=\n)[ ]+if \([^;{}\n]*\) (?=return|continue|break)"), "if (false) "),       # a check left out
]
COMMENTS = {
    "python": re.compile(r'""".*?"""|#[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.DOTALL),
    "c++": re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|#\s*include[^\n]*|\'(?:\\.|[^\'\\\n])\'', re.DOTALL),
}
LEAST = 4  # faults of a room, however small it is


def other_number(text):
    if "e-" in text:
        return f"{float(text) * 1e3:g}"
    if "." in text:
        return f"{float(text) / 2 or 0.5:g}"
    return str(int(text) + 1)


def sites(text, language):
    """(offset, old, new) of everything that may be exchanged."""
    blanked = COMMENTS[language].sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    for pattern, new in EXCHANGES:
        for match in pattern.finditer(blanked):
            old = text[match.start() : match.end()]
            yield match.start(), old, new if new is not None else other_number(old)


def room_of(file):
    parts = file.split("/")
    return parts[1] if parts[0] == "lib" else parts[0]


def shares(places, count):
    """How many of each room: in proportion to the places that it offers, but a few at least."""
    offered = {room: len(rows) for room, rows in sorted(places.items())}
    rest = max(0, count - LEAST * len(offered))
    return {room: min(n, LEAST + round(rest * n / sum(offered.values()))) for room, n in offered.items()}


def draw(root, files, count, seed):
    """About `count` faults over lib, app and scripts."""
    places = collections.defaultdict(list)
    for name in sorted(files):
        if not name.startswith(("lib/", "app/", "scripts/")) or not name.endswith((".cpp", ".h", ".py")) or "/plots/" in name:
            continue
        text = (root / name).read_text()
        for offset, old, new in sites(text, "python" if name.endswith(".py") else "c++"):
            around = text[max(0, offset - 60) : offset + len(old) + 60]
            lot = hashlib.sha256(f"{seed}:{name}:{around}:{new}".encode()).hexdigest()
            places[room_of(name)].append((lot, name, text.count("\n", 0, offset) + 1, offset, old, new))
    out = []
    for room, number in shares(places, count).items():
        for lot, name, line, offset, old, new in sorted(places[room])[:number]:
            out.append({"id": f"drawn-{name.split('/')[-1].split('.')[0]}-{lot[:6]}", "file": name, "room": room, "from": old, "to": new,
                        "what": f"line {line}: {old.strip()} becomes {new.strip() or 'nothing'}", "offset": offset, "equivalent": ""})
    return out
