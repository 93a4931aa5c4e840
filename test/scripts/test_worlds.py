"""The worlds of a report (worth.py): which numbers members, repeats and clocks put in the place of which, and what
is said of them."""
import math
import unittest

import made
from contactbench import gather, sections, worth
from folder import Folder


class Worlds(Folder):
    def results(self):
        """Two cells: of the first three repeats and two members, of the second two and one."""
        rows = [
            made.row(k=k, repeat=n, sweeps=f"s{k}", processing_s=s, solve_s=10 * s, wall_s=100 * s, peak_memory_mb=s, busy=busy,
                     error_a=0.5, solves=7, events="", status="ok")
            for k, some in (("4", ((1, 8, "true"), (2, 2, "false"), (3, 4, "false"))),
                            ("8", ((1, 3, "false"), (2, 5, "false")))) for n, s, busy in some]
        members = [
            made.row(k=k, member=n, run=f"m{k}{n}", processing_s=77, busy="", error_a=error, solves=n + 10, status=status)
            for k, n, error, status in (("4", 1, 0.625, "ok"), ("8", 1, 0.5, "ok"), ("4", 2, 0.75, "ray"))]
        return made.results(self.top, rows, members, timing={"runs_on_a_busy_machine": 1})

    @staticmethod
    def words(world, *columns):
        return [tuple(row[c] for c in columns) for row in world.table.to_dict("records")]

    def test_a_member_stands_in_the_place_of_its_cell_with_the_times_and_the_name_of_the_published_run(self):
        results = self.results()
        own, first, second = worth.members(results)
        self.assertEqual(self.words(own, "run", "error_a"), self.words(results, "run", "error_a"))
        for world in (first, second):
            for column in ("run", "repeat", "sweeps", *gather.TIMING):
                self.assertEqual(self.words(world, column), self.words(results, column), column)
        self.assertEqual(self.words(first, "error_a", "status", "solves"),
                         [("0.625", "ok", "11")] * 3 + [("0.5", "ok", "11")] * 2)
        self.assertEqual(self.words(second, "error_a", "status", "solves"),
                         [("0.75", "ray", "12")] * 3 + [("0.5", "ok", "7")] * 2)
        # Files are those of the member, where there is one.
        self.assertEqual([[c.folder.name for c in world.cells(sweep=None)] for world in (first, second)],
                         [["m41", "m81"], ["m42", results.cells(sweep=None)[1].folder.name]])
        self.assertEqual([world.aside for world in (own, first, second)], [0, 1, 2])
        self.assertEqual(worth.members(made.results(self.top / "alone", [made.row()])), [])

    def test_a_repeat_has_its_times_in_all_rows_and_the_last_one_s_where_there_are_fewer(self):
        results = self.results()
        worlds = worth.repeats(results)
        self.assertEqual([self.words(world, "processing_s", "solve_s", "busy") for world in worlds],
                         [[("8", "80", "true")] * 3 + [("3", "30", "false")] * 2, [("2", "20", "false")] * 3 + [
                             ("5", "50", "false")] * 2, [("4", "40", "false")] * 3 + [("5", "50", "false")] * 2])
        self.assertEqual([world.repeat for world in worlds], [1, 2, 3])
        self.assertEqual([self.words(world, "run", "error_a") for world in worlds], [self.words(results, "run", "error_a")] * 3)
        self.assertEqual(worth.repeats(worlds[0]), [])  # of a world there are none
        other = made.results(self.top / "other", [made.row(repeat=n, processing_s=n) for n in (1, 2)])
        self.assertEqual([self.words(worth.beside(other, world), "processing_s") for world in (results, *worlds)],
                         [[("1", ), ("2", )], [("1", )] * 2, [("2", )] * 2, [("2", )] * 2])
        turned = worth.beside(other, worth.clock(results, 3))
        self.assertEqual(turned.clock.draw, 3)

    def test_a_clock_turns_all_that_is_timed_and_what_no_member_made_too(self):
        results = self.results()
        results.ensemble = results.ensemble[:1]  # of the cell of k = 4
        worlds = [worth.clock(results, draw) for draw in (0, 1, 2)]
        for world in worlds:
            self.assertEqual(world.manifest["timing"], {"runs_on_a_busy_machine": 2})
            before, after = (self.words(of, "processing_s", "wall_s", "peak_memory_mb") for of in (results, world))
            for old, new in zip(before, after):
                first, *others = (float(b) / float(a) for a, b in zip(old, new))
                self.assertTrue(all(math.isclose(first, of) for of in others), "one clock a run")
                self.assertNotAlmostEqual(first, 1, 6)
            self.assertEqual(self.words(world, "error_a", "solves", "events")[:3], [("0.5", "7", "")] * 3)
            self.assertEqual(self.words(world, "k", "step", "status"), self.words(results, "k", "step", "status"))
        # By one percent and the number of the clock more; whole numbers by one.
        self.assertEqual([self.words(world, "error_a", "solves", "events")[3] for world in worlds],
                         [(repr(0.5 * x), str(n), "") for x, n in ((1.01, 8), (1.02, 9), (1.03, 10))])
        self.assertEqual([{busy for busy, in self.words(world, "busy")} for world in worlds], [{"true"}, {"false"}, {"true"}])
        # Without an ensemble nobody was asked, so that nothing is alone.
        alone = made.results(self.top / "alone", [made.row(error_a=0.5)])
        self.assertEqual(self.words(worth.clock(alone, 0), "error_a"), [("0.5", )])

    def test_another_table_is_turned_where_it_is_timed_or_was_made_once(self):
        results = self.results()
        row = {"solver": "a", "time_us": "1", "solve_s": "2", "ratio": "0.5", "busy": "True", "size": "7", "note": "x"}
        made.write_rows(self.top / "t.csv", [row])
        turned, = worth.clock(results, 1).read("t.csv").to_dict("records")
        self.assertEqual((turned["solver"], turned["busy"], turned["note"]), ("a", "False", "turned"))
        for column in ("time_us", "solve_s", "ratio", "size"):
            self.assertNotEqual(turned[column], row[column])
        made.write_rows(self.top / "members/1/t.csv", [row])
        turned, = worth.clock(results, 1).read("t.csv").to_dict("records")
        self.assertEqual((turned["size"], turned["note"]), ("7", "x"))
        self.assertEqual([turned[column] == row[column] for column in ("solve_s", "time_us", "ratio", "busy")], [False] * 4)

    def test_a_section_is_built_of_each_world_and_what_a_member_lacks_is_not_asked_of_it(self):
        results = self.results()
        made.write_rows(self.top / "t.csv", [{"size": "7"}])
        made.write_rows(self.top / "members/1/t.csv", [{"size": "9"}])

        def section(world):
            size = int(world.read("t.csv")["size"][0])
            cell = world.cells(sweep=None)[0]
            return sections.Section("title", {"size": size}, {"size": size, "asked": cell["k"]}, {"seconds": cell.seconds})

        built, of_data, of_timing = worth.Worlds(results).build(section, results)
        self.assertEqual(of_data, {"size": {"sample": 2, "median": 8.0, "least": 7, "most": 9}, "asked": worth.EXACT})
        self.assertEqual(of_timing, {"sample": 3, "median": 4.0, "least": 2.0, "most": 8.0})
        self.assertEqual((str(built.shown["size"]), built.data["size"]), ("8 [7 to 9]", 7))


class Compared(unittest.TestCase):
    def test_rows_are_about_the_same_run_the_same_cell_or_the_same_words(self):
        cell = made.cell(run="a__r2")
        self.assertEqual([worth.run_of(row) for row in ({"run": "b"}, {"cell": cell}, {"x": 1}, "b")],
                         ["b", "a__r2", None, None])
        self.assertEqual([worth.identity(row) for row in ({"run": "b", "x": "y"}, {"x": "y", "n": 3, "z": "w"}, "word", 7)],
                         ["b", ("y", "w"), "word", None])
        self.assertEqual(worth.unrepeated("a__r1__m__r12"), "a__r1__m")
        # In lists of other lengths by what they are about; of the same by their place; else they are absent.
        like = [{"name": "a", "n": 1}, {"name": "b", "n": 2}]
        shorter, longer = [{"name": "b", "n": 3}], [{"name": "x", "n": 4}, {"name": "b", "n": 5}, {"name": "a", "n": 6}]
        self.assertEqual([worth.child(longer, n, like)["n"] for n in (0, 1)], [6, 5])
        self.assertEqual((worth.child(shorter, 0, like), worth.child(shorter, 1, like)["n"]), (worth.ABSENT, 3))
        self.assertEqual(worth.child(longer[:2], 0, like)["n"], 4)
        self.assertEqual((worth.child({}, "a", {"a": 1}), worth.child(7, 0, [1]), worth.child(worth.OTHER, 0, [1])),
                         (worth.ABSENT, worth.ABSENT, worth.OTHER))

    def test_one_class_stands_for_all_that_are_alike_and_numbers_are_counted_below_it(self):
        tree = {"a": [1.0, 2.0], "b": {"c": 3.0, "d": "word"}, "e": {}, "f": 4.0}
        other = {"a": [1.0, 2.5], "b": {"c": 3.0 * (1 + 1e-12), "d": "word"}, "e": {}, "f": 4.0}
        classes = worth.worth(tree, [tree, other], [tree], [tree])
        sample = {"sample": 2, "median": 2.25, "least": 2.0, "most": 2.5}
        self.assertEqual(classes,
                         {"a": [worth.EXACT, sample], "b": {"c": worth.ROUNDED, "d": worth.EXACT}, "e": {}, "f": worth.EXACT})
        self.assertEqual(worth.counted(tree, classes), {worth.EXACT: 2, "sample": 1, worth.ROUNDED: 1})
        self.assertEqual(worth.worth(tree, [tree, tree], [tree], [tree]), worth.EXACT)
        self.assertEqual(worth.counted([[tree, True, None]], worth.EXACT), {worth.EXACT: 4})
        self.assertEqual(worth.worth([], [[]], [], []), {})
        # Parts that are alike in shape, each with numbers of two classes, keep their places.
        twins, others = ({name: {"x": 1.0, "y": y} for name in "pq"} for y in (2.0, 2.5))
        self.assertEqual(worth.worth(twins, [twins, others], [twins], [twins]),
                         {name: {"x": worth.EXACT, "y": sample} for name in "pq"})
        self.assertEqual([worth.is_class(of) for of in ("exact", {"sample": 2}, {"sample": {"sample": 2}}, {}, [])],
                         [True, True, False, False, False])

    def test_a_sample_with_words_keeps_its_numbers_and_leaves_sentences_uncounted(self):
        self.assertEqual(worth.found([3, "ok", 1, "ok", "x" * 60, None]),
                         {"sample": 6, "words": {"None": 1, "ok": 2}, "numbers": [1, 3]})
        # What the clock moves is a sample of the repeats and of what members came to besides.
        self.assertEqual(worth.worth_of(2.0, [2.0, 7.0], [2.0, 3.0], [9.0]),
                         {"sample": 3, "median": 3.0, "least": 2.0, "most": 7.0})

    def test_a_number_of_a_sample_says_of_how_many_it_is(self):
        for values, said in (([2.0, 1.0, 4.0], "2 [1 to 4]"), ([2.0, None, 4.0, "ray"], "3 [2 to 4] in 2 of 4"), ([
                2.0, None], "2 in 1 of 2"), ([1, 2, 4, 12], "3 [1 to 12]"), ([1.0, 1.0 + 1e-12], "1")):
            self.assertEqual(str(worth.Number(values[0], values)), said)
        self.assertEqual(f"{worth.Number(None, [0.123456, 0.2]):.2g}", "0.16 [0.12 to 0.2]")
        self.assertTrue(math.isnan(worth.Number(None, [1.0])))
        self.assertEqual(
            [worth.published(v) for v in (worth.Number(None, [1.0]), worth.Number(2, [1, 2]), worth.Word("a", ["a", "b"]), 3)],
            [None, 2, "a", 3])

    def test_a_word_of_a_sample_says_how_often_each_came(self):
        self.assertEqual(str(worth.Word("ok", ["ok", "ray", "ray", ""])), "ray in 2 of 4, ok in 1 of 4, none in 1 of 4")
        text = "it takes 2 of 10 steps, 0.5 s and 1e-3 m for k8 and x_1"
        self.assertEqual(
            worth.merged(text, [text.replace("2 of", "12 of").replace("1e-3", "2e-4"),
                                text.replace("0.5", "3"), text]),
            "it takes 2 [2 to 12] of 10 steps, 0.5 [0.5 to 3] s and 1e-3 [2e-4 to 1e-3] m for k8 and x_1")
        self.assertEqual(worth.merged("1 a", ["2 b", "3 a"]), "1 [1 to 3] a (otherwise in 1 of 2 runs of the ensemble)")
        self.assertEqual([worth.agreed(words, "differs") for words in (["a", "a"], ["a", "b"])], ["a", "differs"])

    def test_what_is_carried_keeps_its_shape_and_what_is_of_the_published_runs_alone_its_numbers(self):
        own = {"t": (1.0, "ok"), "alone": sections.Plain(n=1.0), "none": None, "nan": math.nan}
        others = [own, {"t": (3.0, "ray"), "alone": sections.Plain(n=9.0), "none": 5.0, "nan": math.nan}]
        shown = worth.carried(own, others)
        self.assertEqual((str(shown["t"][0]), str(shown["t"][1]), shown["alone"]["n"]),
                         ("2 [1 to 3]", "ok in 1 of 2, ray in 1 of 2", 1.0))
        self.assertEqual((type(shown["t"]), str(shown["none"]), worth.published(shown["none"])), (tuple, "5 in 1 of 2", None))
        self.assertTrue(math.isnan(shown["nan"]) and not isinstance(shown["nan"], worth.Number))


if __name__ == "__main__":
    unittest.main()
