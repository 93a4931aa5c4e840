"""What each number of the report is worth: whether it repeats exactly, to rounding, or is a sample. Nobody says so of a
number; it is found out by building the report once more of each of several tables of runs, and comparing.

Members: the cells with other last bits at the start and contacts in another order (plan.Run.as_member). What differs
among them by more than rounding is decided by what nobody chose: chaos, or one of several right answers. Repeats: the
times of one repeat in place of the median. Clocks: every time multiplied by a number of its own, which shows what is
measured, or follows from what is; by several, since a yes, a no or a small number may come out the same by one.
"""
import collections
import functools
import math
import re
import statistics

import pandas as pd

from .gather import CELL, COLUMNS, TIMING, close, is_number
from .runs import Clock, Runs

DRAWS = 8  # clocks
# What a run came to in numbers that are no times and no errors: what follows how far it came.
OUTCOMES = {c for c in list(COLUMNS)[list(COLUMNS).index("t_reached") + 1:] if c not in TIMING}
EXACT, ROUNDED = "exact", "rounding"
LONG = 60  # characters; sentences are counted and not listed
ABSENT = "absent"
OTHER = "another"  # at this place stands what is about another run
DIGITS = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?")

# Tables of runs.


def member(results: Runs, number: int) -> Runs:
    """The table with what a member came to, and with the times of the published runs; a cell without that member (its
    first differed by rounding only) stays as it is."""
    of = {tuple(row[c] for c in CELL): row for row in results.ensemble if row["member"] == str(number)}
    kept = (*TIMING, "run", "repeat", "sweeps")

    def seen(row):
        other = of.get(tuple(row[c] for c in CELL))
        return {**other, **{c: row[c] for c in kept}, "folder": other["run"]} if other else row

    return results.seen(pd.DataFrame(map(seen, results.table.to_dict("records"))).fillna(""), aside=number)


# Of results that are themselves such a table there are none.


@functools.cache
def members(results: Runs) -> list[Runs]:
    """The published runs by themselves, and with what each member came to in their place; none without an ensemble."""
    last = max((int(row["member"]) for row in results.ensemble), default=0)
    return [results.seen(results.table)] + [member(results, n) for n in range(1, last + 1)] if last else []


@functools.cache
def repeats(results: Runs) -> list[Runs]:
    """One table a repeat, with its times in all rows of the cell; the last one's where it has fewer."""
    table, out = results.table, []
    columns = [c for c in TIMING if c in table]
    for number in range(1, table["repeat"].astype(int).max() + 1 if results.whole and len(table) else 1):
        of = {tuple(row[c] for c in CELL): row for row in table.to_dict("records") if int(row["repeat"]) <= number}
        some = table.copy()
        some[columns] = [
            [of[tuple(row[c] for c in CELL)][name] for name in columns] for row in table.to_dict("records")]
        out.append(results.seen(some, repeat=number))
    return out


def clock(results: Runs, draw: int) -> Runs:
    """The results of a machine that is faster and slower by turns, and used by others. What no member made too has
    other numbers besides: nobody knows their spread."""
    by, some = Clock(draw), results.table.copy()
    for column in (c for c in TIMING if c in some):
        some[column] = [
            by.turned(cell, run) if cell in ("true", "false") else cell and repr(float(cell) * by.factor(run))
            for cell, run in zip(some[column], some["run"])]
    made = {tuple(row[c] for c in CELL) for row in results.ensemble}
    alone = [made and cell not in made for cell in some[CELL].itertuples(index=False, name=None)]
    for column in (c for c in some if c.startswith("error_") or c in OUTCOMES):
        some[column] = [other(cell, draw) if cell and once else cell for cell, once in zip(some[column], alone)]
    turned = results.seen(some, clock=by)
    counts = results.manifest.get("timing", {})
    turned.manifest = results.manifest | {"timing": {what: count + 1 for what, count in counts.items()}}
    return turned


def other(cell: str, draw: int) -> str:
    """Another number of the kind, so near that what is fitted to several can still be."""
    return str(int(cell) + 1 + draw) if cell.isdigit() else repr((float(cell) + 1e-300) * (1.01 + 0.01 * draw))


def beside(results: Runs, world: Runs) -> Runs:
    """A table of another folder, without ensemble, as a world of the report has it."""
    if world.clock:
        return clock(results, world.clock.draw)
    some = repeats(results) if world.repeat else [results]
    return some[min(world.repeat, len(some)) - 1]


# The same place in several trees of dictionaries and lists.


def run_of(row):
    """The run that a row, or a part of one, is about; None of what is about none."""
    return (row.get("run") or (row["cell"]["run"] if "cell" in row else None)) if isinstance(row, dict) else None


def unrepeated(run):
    """The name of a run without the number of its repeat."""
    return run.rsplit("__r", 1)[0]


def identity(row):
    """What a row of a list is about."""
    if not isinstance(row, dict):
        return row if isinstance(row, str) else None
    return run_of(row) or tuple(v for v in row.values() if isinstance(v, str))


def child(tree, key, like):
    """The part of another tree at a key of `like`: of a list what is about the same run, else about another repeat of
    it, else by index in one of the same length, else by what it is about. What is about another run is not compared."""
    if isinstance(tree, str) and tree == OTHER:
        return OTHER
    run = run_of(like[key])
    if isinstance(like, dict):
        part = tree.get(key, ABSENT) if isinstance(tree, dict) else ABSENT
        return OTHER if run and run_of(part) and unrepeated(run_of(part)) != unrepeated(run) else part
    if not isinstance(tree, (list, tuple)):
        return ABSENT
    if run:
        # Which repeat has the median time is a matter of the clock.
        same = [row for row in tree if run_of(row) and unrepeated(run_of(row)) == unrepeated(run)]
        return next((row for row in same if run_of(row) == run), same[0] if same else OTHER)
    if len(tree) == len(like):
        return tree[key]
    return next((row for row in tree if identity(row) == identity(like[key]) is not None), ABSENT)


def keys(tree):
    return tree.keys() if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, (list, tuple)) else None


def plain(value):
    """A leaf as it is compared: what is no number is None."""
    return None if isinstance(value, float) and math.isnan(value) else value


# Classes.


def found(values: list):
    """What several values of a leaf say of a sample."""
    some = sorted(v for v in values if is_number(v))
    if len(some) < len(values):
        words = collections.Counter(str(v) for v in values if not is_number(v) and len(str(v)) < LONG)
        return {"sample": len(values), "words": dict(sorted(words.items())), **({"numbers": some} if some else {})}
    return {"sample": len(values), "median": statistics.median(some), "least": some[0], "most": some[-1]}


def worth_of(value, own: list, timed: list, turned: list):
    """The class of a leaf: its values among the members, among the repeats, and by the other clocks. Without members
    nothing is known."""
    if any(v != value for v in turned) or not own:
        several = list(dict.fromkeys(timed + [v for v in own if v != value]))
        return found(several) if len(several) > 1 else {"sample": 1}
    if not all(close(value, v) for v in own):
        return found(own)
    return EXACT if all(value == v for v in own) else ROUNDED


def is_class(tree):
    return isinstance(tree, str) or isinstance(tree, dict) and isinstance(tree.get("sample"), int)


def worth(tree, own: list, timed: list, turned: list):
    """A tree of classes of the same shape; one class where all below are alike."""
    if keys(tree) is None:
        return worth_of(plain(tree), *([*map(plain, values)] for values in (own, timed, turned)))
    parts = {
        key: worth(tree[key], *([child(t, key, tree) for t in trees] for trees in (own, timed, turned)))
        for key in keys(tree)}
    some = [part for part in parts.values() if part]  # what is empty holds nothing to class
    if not some:
        return {}
    if is_class(some[0]) and all(part == some[0] for part in some):
        return some[0]
    return parts if isinstance(tree, dict) else list(parts.values())


def counted(tree, classes, count=None):
    """{class: how many numbers of the tree}."""
    count = collections.Counter() if count is None else count
    if keys(tree) is not None:
        for key in keys(tree) if classes else ():
            counted(tree[key], classes if is_class(classes) else classes[key], count)
    elif is_number(tree):
        count[classes if isinstance(classes, str) else "sample"] += 1
    return count


# What a page shows of a sample.


class Number(float):
    """A number that is a sample: printed as median, least and most."""
    value: float | None  # of the published run
    values: list  # of all

    def __new__(cls, value, values):
        self = super().__new__(cls, math.nan if value is None else value)
        self.value, self.values = value, values
        return self

    def __format__(self, spec):
        some = [v for v in self.values if is_number(v)]
        of = "" if len(some) == len(self.values) else f" in {len(some)} of {len(self.values)}"
        spread = "" if close(min(some), max(some)) else f" [{min(some):{spec}} to {max(some):{spec}}]"
        return f"{statistics.median(some):{spec}}{spread}{of}"

    def __str__(self):
        return format(self, ".4g" if any(isinstance(v, float) for v in self.values) else "g")


class Whole(str):
    """A sentence that rests on the ensemble as a whole: what members would say alone is nothing beside it."""
    alone = True


def merged(text, values):
    """A sentence with the range of each number that differs among those that say the same in other numbers; how many
    say something else."""
    same = [DIGITS.findall(v) for v in values if DIGITS.sub("#", v) == DIGITS.sub("#", text)]
    ranges = zip(DIGITS.findall(text), *same)
    parts = iter(DIGITS.split(text))
    out = next(parts)
    for own, *others in ranges:
        some = sorted({own, *others}, key=float)
        out += (f"{own} [{some[0]} to {some[-1]}]" if float(some[0]) < float(some[-1]) else own) + next(parts)
    rest = len(values) - len(same)
    return out + (f" (otherwise in {rest} of {len(values)} runs of the ensemble)" if rest else "")


class Word(str):
    """A word that is a sample: printed with what else there was."""
    def __new__(cls, value, values):
        self = super().__new__(cls, value)
        self.value = value
        count = collections.Counter(str(v) for v in values)
        self.text = ", ".join(f"{v or 'none'} in {n} of {len(values)}" for v, n in count.most_common())
        if len(value) >= LONG:
            self.text = merged(value, [*map(str, values)])
        return self

    def __format__(self, spec):
        return self.text

    def __str__(self):
        return self.text


def carried(tree, own: list):
    """The tree with its samples as Number and Word; what is marked as the published runs' alone stays."""
    if getattr(tree, "alone", False):
        return tree
    if keys(tree) is not None:
        parts = {key: carried(tree[key], [child(t, key, tree) for t in own]) for key in keys(tree)}
        return parts if isinstance(tree, dict) else type(tree)(parts.values())
    values = [v for v in map(plain, own) if v != OTHER]
    if all(close(plain(tree), v) for v in values):
        return tree
    if any(is_number(v) for v in values):
        return Number(tree if is_number(tree) else None, values)
    return Word(tree, values) if isinstance(tree, str) else tree


def published(value):
    """The value itself of what is carried."""
    return value.value if isinstance(value, (Number, Word)) else value


def agreed(words, otherwise):
    """The word that all say."""
    words = set(words)
    return words.pop() if len(words) == 1 else otherwise


class Worlds:
    """The tables of runs of which a report is built besides its own."""
    def __init__(self, results: Runs):
        self.members, self.repeats = members(results), repeats(results)
        self.clocks = [clock(results, draw) for draw in range(DRAWS)]

    def build(self, section, results):
        """A section with its classes, and what it shows with its samples."""
        made, own = section(results), []
        timed, turned = ([section(world) for world in worlds] for worlds in (self.repeats, self.clocks))
        for world in self.members:
            world.lacking = False
            seen = section(world)
            own += [] if world.lacking else [seen]

        def classes(part):
            pick = functools.partial(lambda name, s: getattr(s, name), part)
            return worth(pick(made), *([*map(pick, worlds)] for worlds in (own, timed, turned)))

        made.shown = carried(made.shown, [s.shown for s in own])
        return made, classes("data"), classes("timing")
