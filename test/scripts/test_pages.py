"""What the scripts of the pages do (templates/report.js, view.js), on made-up tables and motions, in a browser."""
import json
import math
import unittest
from pathlib import Path

import browser
import numpy as np
from contactbench import templates, view
from test_motions import Made, contact

HEAD = """<!DOCTYPE html><html><head><meta charset="utf-8"><link rel="icon" href="data:,"><style>
:root { --page: #ffffff; } :root[data-theme="dark"] { --page: #17191c; } svg { width: 800px; height: 400px; }</style></head>
<body><nav><button id="theme"></button><a href="#one">1</a></nav><section id="one"></section>"""


def source(name):
    return (Path(templates.__file__).parent / name).read_text()


def report(body):
    """A page of the report's script about `body`."""
    return f"{HEAD}{body}<script>{source('report.js')}</script></body></html>"


def table(rows, heads=("name", "error")):
    cells = lambda of, tag: "<tr>" + "".join(f"<{tag}>{c}</{tag}>" for c in of) + "</tr>"
    body = "".join(cells(row, "td") for row in rows)
    return f"<div><table class='sorts'><thead>{cells(heads, 'th')}</thead><tbody>{body}</tbody></table></div>"


@unittest.skipUnless(browser.CHROMIUM, browser.WHY_NOT)
class Tables(unittest.TestCase):
    ROWS = [("beta", "1.5e-3"), ("alpha", "< 1e-12"), ("gamma", "-2 (least -3)"), ("delta", ""), ("Epsilon", "20 ms"), ("zeta", "crash"),
            ("eta", ".5"), ("theta", "+3"), ("iota", "10")]
    SHOWN = """const heads = document.querySelectorAll('th');
        const shown = () => [...document.querySelectorAll('tbody tr')].filter(r => !r.hidden).map(r => r.cells[0].textContent);"""

    def test_rows_sort_by_numbers_and_words_up_and_down_with_what_has_none_at_the_end(self):
        found = browser.asked(report(table(self.ROWS)), self.SHOWN + """
            const out = {}; heads[1].click(); out.up = shown(); out.up_said = heads[1].getAttribute('aria-sort');
            heads[1].click(); out.down = shown(); out.down_said = heads[1].getAttribute('aria-sort');
            heads[0].dispatchEvent(new KeyboardEvent('keydown', { key: 'x' })); out.other_key = shown();
            heads[0].dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter' })); out.words = shown();
            out.cleared = heads[1].getAttribute('aria-sort');
            heads[0].click(); out.words_down = shown(); return out;""")
        up = ["gamma", "alpha", "beta", "eta", "theta", "iota", "Epsilon"]
        self.assertEqual(found["up"], [*up, "delta", "zeta"])
        self.assertEqual(found["down"], [*up[::-1], "delta", "zeta"])
        self.assertEqual((found["up_said"], found["down_said"], found["cleared"]), ("ascending", "descending", None))
        self.assertEqual(found["other_key"], found["down"])
        words = ["alpha", "beta", "delta", "Epsilon", "eta", "gamma", "iota", "theta", "zeta"]
        self.assertEqual((found["words"], found["words_down"]), (words, words[::-1]))

    def test_a_column_of_words_with_some_numbers_sorts_as_words(self):
        rows = [("a", "9 lives"), ("b", "alone"), ("c", "10 lives"), ("d", "zero")]
        found = browser.asked(report(table(rows)), self.SHOWN + "heads[1].click(); return shown();")
        self.assertEqual(found, ["c", "a", "b", "d"])  # half of them are no more than half

    def test_rows_are_filtered_by_all_words_and_short_tables_have_no_filter(self):
        found = browser.asked(report(table(self.ROWS)), self.SHOWN + """
            const input = document.querySelector('.filter input'), type = words => { input.value = words; input.oninput(); return shown(); };
            return { one: type('ETA'), two: type('eta 1'), none: type('eta nothing'), all: type('').length,
                     before: !!(document.querySelector('.filter').compareDocumentPosition(document.querySelector('table')) & 4) };""")
        self.assertEqual(found["one"], ["beta", "zeta", "eta", "theta"])
        self.assertEqual(found["two"], ["beta"])
        self.assertEqual((found["none"], found["all"], found["before"]), ([], 9, True))
        count = "return document.querySelectorAll('.filter').length;"
        self.assertEqual(browser.asked(report(table(self.ROWS[:8])), count), 0)

    def test_a_head_without_a_name_sorts_nothing(self):
        found = browser.asked(report(table(self.ROWS, ("", "error"))),
                              self.SHOWN + "heads[0].click(); return [shown(), heads[0].className, heads[1].className, heads[1].tabIndex];")
        self.assertEqual(found, [[name for name, _ in self.ROWS], "", "sorts", 0])

    def test_light_turns_to_dark_and_back_and_an_address_begins_dark(self):
        click = "const at = () => getComputedStyle(document.documentElement).getPropertyValue('--page').trim(), out = [at()];" \
                "for (let i = 0; i < 2; ++i) { document.getElementById('theme').click(); out.push(at()); } return out;"
        self.assertEqual(browser.asked(report(""), click), ["#ffffff", "#17191c", "#ffffff"])
        self.assertEqual(browser.asked(report(""), click, "theme=dark"), ["#17191c", "#ffffff", "#17191c"])


def point(label, error, time, good=True, **more):
    return {"label": label, "key": label.split()[0], "error": error, "few": error, "worst": error, "time": time, "least": time,
            "most": time, "repeats": 1, "status": "ok", "good": good, "uncertainty": 0, "command": f"run {label}", "run": f"r_{label}"} | more


@unittest.skipUnless(browser.CHROMIUM, browser.WHY_NOT)
class ErrorAgainstTime(unittest.TestCase):
    """The drawing of templates/sections/error_time.html."""
    POINTS = [point("ap 1e-2", 1e-2, 1e-3), point("ap 1e-4", 1e-4, 1e-1), point("soft 1e-4", 1e-4, 1e-2, status="inaccurate", good=False),
              point("convex 1e-5", 1e-5, 1.0, worst=5e-4, few=1e-6, repeats=3, least=0.9, most=1.234567), point("ap 0", 0.0, 10.0),
              point("unsure", 9e-4, 1e-2, uncertainty=2e-4)]
    READ = """const all = q => [...document.querySelectorAll(q)], text = q => all(q)[0].textContent, of = (e, ...names) => names.map(n => e.getAttribute(n));
        const out = { answer: all('.answer')[0].innerHTML, output: text('output'), legend: text('.legend'), scenes: all('option').map(o => o.text),
                      hidden: all('.unscripted')[0].hidden, labels: all('svg text').map(t => t.textContent),
                      circles: all('circle').map(c => [...of(c, 'cx', 'cy', 'r').map(Number), ...of(c, 'fill', 'class')]),
                      lines: all('svg line').map(l => [...of(l, 'x1', 'x2', 'y1', 'y2').map(Number), ...of(l, 'class')]) };
        """
    SLIDE = "const slide = v => { const i = document.querySelector('#points input'); i.value = v; i.oninput(); };"
    COLOURS = {"ap": "red", "soft": "blue", "convex": "green", "unsure": "gray"}

    def page(self, scenes):
        body = '<div id="points" hidden><select></select><input type="range" min="-13" max="0" step="0.05" value="-3"><output></output>' \
               '<p class="answer"></p><svg></svg><p class="legend"></p><p class="said"></p></div><div class="unscripted">picture</div>' \
               f'<script type="application/json" id="points_data">{json.dumps({"scenes": scenes, "colours": self.COLOURS})}</script>'
        return report(body)

    def test_points_lie_on_the_lines_of_their_time_and_error(self):
        found = browser.asked(self.page({"box": self.POINTS, "other": self.POINTS[:1]}), self.READ + "return out;")
        across = {line[0]: label for line, label in zip(found["lines"], found["labels"]) if line[0] == line[1]}
        down = {line[2]: label for line, label in zip(found["lines"], found["labels"]) if line[2] == line[3]}
        at = lambda where, x: next(label for place, label in where.items() if abs(place - x) < 1e-6)
        named = [(at(across, x), round(y, 6)) for x, y, *_ in found["circles"]]
        self.assertEqual([x for x, _ in named], ["1e-3", "1e-1", "1e-2", "1e0", "1e1", "1e-2"])
        # Errors between two lines lie between them as their powers do.
        place = {round(math.log10(float(label))): y for y, label in down.items() if label.startswith("1e")}
        powers = sorted(place)
        slope, start = np.polyfit(powers, [place[p] for p in powers], 1)
        height = lambda error: start + slope * math.log10(error)
        self.assertLess(max(abs(height(10.0**p) - place[p]) for p in powers), 1e-6)
        for (_, y, *_), error in zip(found["circles"], (1e-2, 1e-4, 1e-4, 1e-5, 1e-16, 9e-4)):
            self.assertAlmostEqual(y, height(error), 3)
        wanted = next(line for line in found["lines"] if line[4] == "wanted")
        self.assertAlmostEqual(wanted[2], height(1e-3), 3)
        self.assertGreater(min(y for _, y, *_ in found["circles"]), 0)
        self.assertEqual([fill for *_, fill, _ in found["circles"]], ["red", "red", "blue", "green", "red", "gray"])
        self.assertEqual((found["scenes"], found["hidden"], found["output"]), (["box", "other"], True, "0.0010 m"))
        self.assertEqual(found["legend"].split(), ["ap", "soft", "convex", "unsure"])

    def test_the_cheapest_good_one_within_the_wanted_error_is_advised(self):
        found = browser.asked(self.page({"box": self.POINTS}), self.SLIDE + """return [-3, -1, -4.5, -13].map(v => {
            slide(v); const wanted = document.querySelector('.wanted').getAttribute('y1');
            return [document.querySelector('.answer').textContent, [...document.querySelectorAll('circle')].map(c => c.getAttribute('class')), wanted]; });""")
        milli, tenth, little, least = found
        self.assertIn("Cheapest that meets it: ap 1e-4: error 0.0001 m, 0.1 s a simulated second, one run", milli[0])
        self.assertIn("run ap 1e-4", milli[0])
        # soft is not ok, of `unsure` the uncertainty counts, and the largest error of convex's ensemble does.
        self.assertEqual([c.strip() for c in milli[1]], ["dim", "best", "dim", "", "", "dim"])
        self.assertIn("ap 1e-2", tenth[0])
        self.assertEqual([c.strip() for c in little[1]], ["dim", "dim", "dim", "dim", "best", "dim"])
        self.assertIn("ap 0", least[0])
        self.assertNotEqual(milli[2], tenth[2])

    def test_where_nothing_meets_it_the_nearest_is_said(self):
        points = [point("ap 1e-2", 1e-2, 1e-3), point("ap b", 1e-3, 3.0), point("ap c", 1e-3, 2.0), point("soft", 1e-9, 1.0, good=False)]
        found = browser.asked(self.page({"box": points}), self.SLIDE + "slide(-6);" + self.READ + "return out.answer;")
        self.assertTrue(found.startswith("No setting of the sweep meets it. Nearest: <b>ap c</b>"), found)
        # As in the table of advice: by the whole ensemble, of which a run of this one did not end ok.
        unsure = point("ap d", 1e-4, 1.0, worst=1e300)
        found = browser.asked(self.page({"box": [unsure, *points]}), self.SLIDE + "slide(-6);" + self.READ + "return out.answer;")
        self.assertTrue(found.startswith("No setting of the sweep meets it. Nearest: <b>ap c</b>"), found)
        none = browser.asked(self.page({"box": points[3:]}), self.SLIDE + "slide(-13);" + self.READ + "return out.answer;")
        self.assertEqual(none, "No setting of the sweep meets it. ")

    def test_a_point_that_is_touched_says_its_numbers(self):
        points = [self.POINTS[3], self.POINTS[2], point("<ap> & co", 1.23456e-3, 2.0, worst=1.3e-3, key="ap")]
        found = browser.asked(self.page({"box": points}), """return [...document.querySelectorAll('circle')].map(c => {
            c.onfocus(); return document.querySelector('.said').innerText; });""")
        self.assertIn("convex 1e-5: error 0.00001 m (largest of the ensemble, the least 0.000001) (not all of the ensemble ended ok), "
                      "1 s a simulated second (0.9 to 1.23)", found[0])
        self.assertIn("run r_convex 1e-5", found[0])
        self.assertIn("soft 1e-4: error 0.0001 m, 0.01 s a simulated second, one run, inaccurate", found[1])
        self.assertIn("<ap> & co: error 0.00123 m (not all", found[2])

    def test_another_scene_shows_its_own_points(self):
        found = browser.asked(self.page({"box": self.POINTS, "other": self.POINTS[:1]}), """const s = document.querySelector('select');
            s.value = 'other'; s.onchange(); return document.querySelectorAll('circle').length;""")
        self.assertEqual(found, 1)


@unittest.skipUnless(browser.CHROMIUM, browser.WHY_NOT)
class StiffCases(unittest.TestCase):
    def test_a_cell_says_its_row_with_the_command_on_its_own(self):
        body = """<div id="heat_cell">Point.</div><table class="heat"><tr><td><a href="#c2">w</a><td><a href="#c1">r</a></table>
            <table><thead><tr><th>case<th>reason<th>command</tr></thead><tbody><tr id="c1"><td>S1<td><td>run one
            <tr id="c2"><td>S2<td>drifts<td>run two --k 8</tbody></table>"""
        found = browser.asked(report(body), """
            const panel = document.getElementById('heat_cell'), cells = document.querySelectorAll('.heat a'), out = [];
            const says = () => [...panel.children].map(c => [c.tagName, c.textContent.trim()]);
            cells[0].click(); out.push(says(), location.hash); cells[1].click(); out.push(says());
            cells[0].dispatchEvent(new PointerEvent('pointerover', { pointerType: 'touch', bubbles: true })); out.push(says()[0][1]);
            cells[0].dispatchEvent(new PointerEvent('pointerover', { pointerType: 'mouse', bubbles: true })); out.push(says()[0][1]);
            return out;""")
        self.assertEqual(found[0], [["SPAN", "case: S2;"], ["SPAN", "reason: drifts;"], ["PRE", "run two --k 8"]])
        self.assertEqual(found[1], "")
        self.assertEqual(found[2], [["SPAN", "case: S1;"], ["PRE", "run one"]])
        self.assertEqual(found[3:], ["case: S1;", "case: S2;"])


def about(axis, angle):
    """A quaternion, w first."""
    return (math.cos(angle / 2), *(math.sin(angle / 2) * np.array(axis, float)))


def turned(q, v):
    w, u = q[0], np.array(q[1:])
    return np.array(v) + 2 * np.cross(u, np.cross(u, v) + w * np.array(v))


def matrices(number):
    """Of the arrows of a run: place, direction and lengths along x, y and z of each of a kind (shaft, head, dot) and mode."""
    return f"""const of = (kind, mode) => {{
        const many = current.runs[{number}].arrows[mode][kind], out = [];
        for (let i = 0; i < many.count; ++i) {{
            const x = new THREE.Matrix4(), p = new THREE.Vector3(), q = new THREE.Quaternion(), s = new THREE.Vector3();
            many.getMatrixAt(i, x); x.decompose(p, q, s);
            out.push([p.toArray(), new THREE.Vector3(0, 1, 0).applyQuaternion(q).toArray(), s.toArray()]);
        }}
        return out; }};"""


@unittest.skipUnless(browser.CHROMIUM, browser.WHY_NOT)
@unittest.skipUnless(view.THREE.is_dir(), "libjs-three is not installed: there is no page")
class Motions(Made):
    """The page of view.py: what stands where at a time, and what its controls do."""
    ANGLES = (0.0, 0.4, 1.2, 1.3, 1.3, 1.3)  # of body `one` about z, a moment every 0.1 s
    AT = "const at = x => { byId('time').value = x; byId('time').oninput({ target: byId('time') }); current.runs.forEach(pose); };"

    def moving(self, name="run", **more):
        folder = self.run_of(name, **more)
        rows = (folder / "trajectory.csv").read_text().splitlines()
        out = [rows[0]]
        for row in rows[1:]:
            cells = row.split(",")
            if cells[1] == "one":
                cells[5:9] = map(repr, map(float, about((0, 0, 1), self.ANGLES[round(10 * float(cells[0]))])))
            out.append(",".join(cells))
        (folder / "trajectory.csv").write_text("\n".join(out) + "\n")
        return folder

    def ask(self, script, *folders, where="", **more):
        return browser.asked(view.page([view.scene_of(folders or [self.moving()], **more)]), self.AT + script, where)

    def test_between_two_moments_bodies_are_in_between_and_shapes_go_with_them(self):
        found = self.ask("""const out = [], read = () => { const run = current.runs[0]; run.root.updateMatrixWorld(true);
            const node = run.nodes[0], mesh = node.children[0].getWorldPosition(new THREE.Vector3());
            out.push([node.position.toArray(), node.quaternion.toArray(), mesh.toArray(), byId('now').textContent, t]);
            };
            for (const x of [0, 0.1, 0.125, 0.5]) { at(x); read(); } return out;""")
        for (place, quaternion, mesh, said, t), n, angle in zip(found, (0, 1, 1.25, 5), (0, 0.4, 0.4 + 0.25 * 0.8, 1.3)):
            q = about((0, 0, 1), angle)
            np.testing.assert_allclose(place, (n, 2 * n, -3 * n), atol=1e-6)
            np.testing.assert_allclose(quaternion, [*q[1:], q[0]], atol=1e-6)
            np.testing.assert_allclose(mesh, place + turned(q, (0.1, 0.2, 0.3)), atol=1e-5)
            self.assertEqual(said, f"{0.1 * n:.3f} s")
            self.assertAlmostEqual(t, 0.1 * n)

    def test_the_last_of_rising_numbers_is_found(self):
        found = self.ask("return [[0, 1, 2], [0, 1, 2, 3]].map(list => [-1, 0, 0.5, 1 - 1e-13, 1, 1.999, 2, 9].map(x => before(list, x)));")
        self.assertEqual(found, [[0, 0, 0, 1, 1, 1, 2, 2], [0, 0, 0, 1, 1, 1, 2, 3]])

    def test_surfaces_have_the_sizes_of_their_shapes(self):
        found = self.ask("""
            const shapes = [{ kind: 'box', hx: 1, hy: 2, hz: 3 }, { kind: 'sphere', radius: 0.5 }, { kind: 'capsule', radius: 0.5, hy: 2 },
                            { kind: 'cylinder', radius: 0.5, hy: 2 }, { kind: 'hull', faces: [[[0, 0, 0], [4, 0, 0], [4, 5, 0], [0, 5, -1]]] }];
            return [shapes.map(s => { const g = surface(s, 1); g.computeBoundingBox();
            return [g.boundingBox.min.toArray(), g.boundingBox.max.toArray()]; }),
                    surface({ kind: 'half_space' }, 1), surface(shapes[4], 1).attributes.position.count];""")
        expected = [(1, 2, 3), (0.5, 0.5, 0.5), (0.5, 2.5, 0.5), (0.5, 2, 0.5)]
        for (low, high), half in zip(found[0], expected):
            np.testing.assert_allclose([low, high], [np.negative(half), half], atol=0.01)
        np.testing.assert_allclose(found[0][4], [(0, 0, -1), (4, 5, 0)])
        self.assertEqual(found[1:], [None, 6])

    def test_what_stands_still_stands_where_its_shape_says(self):
        found = self.ask("""const run = current.runs[0]; run.root.updateMatrixWorld(true);
            const still = run.root.children.filter(c => c.isMesh && !c.isInstancedMesh), places = all => all.map(one => one.position.toArray());
            return [places(still), places(run.planes), run.nodes.map(n => n.children.length)];""")
        self.assertEqual(found, [[[7, 8, 9]], [[0, -1, 0]], [1, 1]])

    CONTACTS = (contact(2, "s_one", "ground", (1, 0, 2), (0, 3, 0), "stick"), contact(2, "s_one", "ground", (5, 0, 2), (0, 0, 1.5), "slip"),
                contact(2, "s_two", "ground", (6, 0, 2), (0, 0, 0), "slip"), contact(4, "s_two", "ground", (4, 5, 6), (1, 2, 2), "slip"))

    def test_arrows_are_as_long_as_impulses_at_the_nearest_moment_and_of_the_mode_s_colour(self):
        found = self.ask(matrices(0) + """const out = [], read = () => [0, 1, 2].map(kind => [0, 1, 2].map(mode => of(kind, mode)));
            for (const x of [0.14, 0.16, 0.24, 0.26, 0.4]) { at(x); out.push(read()); }
            at(0.2); byId('length').value = 0.5; current.runs.forEach(pose); out.push(read()); byId('arrows').checked = false;
            current.runs.forEach(pose); out.push(read());
            const run = current.runs[0];
            return [out, current.size, current.impulse, DATA.modes, run.arrows.map(three => three.map(m => m.visible))];""",
                         self.moving(contacts=self.CONTACTS))
        out, size, impulse, modes, visible = found
        counts = [[len(of) for of in read[0]] for read in out]
        self.assertEqual(modes, ["open", "stick", "slip"])
        none, some = [0, 0, 0], [0, 1, 2]
        self.assertEqual(counts, [none, some, some, none, [0, 0, 1], some, none])
        self.assertEqual(visible, [[False] * 3] * 3)
        long = 0.35 * size / impulse
        (shaft, head, dot) = out[1]
        (place, way, scale), = shaft[1]
        np.testing.assert_allclose([place, way, [scale[1], 0, 0]], [(1, 0, 2), (0, 1, 0), (3 * long, 0, 0)], atol=1e-5)
        np.testing.assert_allclose(head[1][0][0], (1, 3 * long, 2), rtol=1e-5)
        np.testing.assert_allclose(dot[1][0][0], (1, 0, 2), atol=1e-6)
        at = {tuple(np.round(p, 3)): (w, s) for p, w, s in shaft[2]}
        np.testing.assert_allclose(at[5, 0, 2][0], (0, 0, 1), atol=1e-6)
        self.assertAlmostEqual(at[5, 0, 2][1][1] / (1.5 * long), 1, 5)
        self.assertLess(at[6, 0, 2][1][1], 1e-6)
        np.testing.assert_allclose(out[4][0][2][0][1], np.array((1, 2, 2)) / 3, atol=1e-5)
        self.assertAlmostEqual(out[5][0][1][0][2][1] / (3 * long), 10**0.5, 4)

    CURVE = """const read = key => {
        byId('curve').value = key; chart(); const all = q => [...document.querySelectorAll('#chart ' + q)];
        return [all('path').map(p => p.getAttribute('d')), all('text').map(x => x.textContent), byId('values').textContent, +byId('cursor').getAttribute('x1')];
        };"""

    def test_a_curve_is_drawn_over_its_axes_and_the_cursor_says_its_value(self):
        steps = [(n, round(0.1 * n, 9), 10.0**-n, 0, 10 + 20 * n, 0) for n in range(1, 6)]
        found = self.ask(self.CURVE + """at(0.35); const curves = ['kinetic_energy', 'residual', 'max_penetration'].map(read);
            return [...curves, [0, 0.25, 0.5].map(chart.x), [chart.back(chart.x(0.25)), chart.back(-99), chart.back(9999)]];""",
                         self.moving(steps=steps))
        energy, residual, overlap, across, back = found

        def points(path):
            return np.array([[float(x) for x in pair.split(" ")] for pair in path[1:].split("L")])

        for (paths, labels, said, cursor), ends, value in ((energy, ("110", "30"), "70 J"), (residual, ("0.1", "0.000010"), "0.001 ")):
            path = points(paths[0])
            np.testing.assert_allclose(path[:, 0], np.interp([0.1, 0.2, 0.3, 0.4, 0.5], (0, 0.5), (across[0], across[2])), atol=0.06)
            drawn = np.linspace(path[0, 1], path[-1, 1], 5)  # even, the one over powers of ten
            np.testing.assert_allclose(path[:, 1], drawn, atol=0.11)
            self.assertEqual([float(x) for x in labels[:2]], [float(x) for x in ends])
            self.assertEqual((labels[2], labels[3], said), ("0", "0.500 s", value))
            self.assertAlmostEqual(cursor, np.interp(0.35, (0, 0.5), (across[0], across[2])), 3)
        self.assertLess(points(energy[0][0])[-1, 1], points(energy[0][0])[0, 1])  # more is higher
        self.assertGreater(points(residual[0][0])[-1, 1], points(residual[0][0])[0, 1])
        self.assertEqual((overlap[0], overlap[1][-1]), ([""], "zero throughout"))
        nothing = self.ask(self.CURVE + "return read('residual')[1];", self.moving("free", steps=[(1, 0.1, "", 0, 1, 0)]))
        self.assertEqual(nothing[-1], "nothing recorded")
        self.assertAlmostEqual(across[1], (across[0] + across[2]) / 2)
        np.testing.assert_allclose(back, [0.25, 0, 0.5])

    def test_it_plays_at_its_speed_to_the_end_and_begins_anew(self):
        found = self.ask("""const out = [], saw = () => out.push([Math.round(1e6 * t) / 1e6, playing, byId('play').textContent]);
            window.requestAnimationFrame = () => {}; last = 1000; saw(); byId('play').onclick(); saw(); frame(1040); saw(); frame(1060);
            saw(); frame(1860); saw();
            byId('speed').value = 0.5; frame(1900); saw(); byId('speed').value = 10; frame(1940); saw(); frame(1960); saw();
            byId('play').onclick(); saw(); byId('play').onclick(); saw(); return out;""")
        self.assertEqual(found, [[0, False, "play"], [0, True, "pause"], [0.04, True, "pause"], [0.06, True, "pause"], [0.16, True, "pause"],
                                 [0.18, True, "pause"], [0.5, False, "play"], [0.5, False, "play"], [0, True, "pause"], [0, False, "play"]])

    def test_keys_step_and_play(self):
        found = self.ask("""const out = [], press = (key, target) => {
                window.onkeydown({ key, target: target || document.body, preventDefault: () => out.push('kept') }); out.push(Math.round(1e6 * t) / 1e6); };
            press('ArrowRight'); press('ArrowRight'); press('ArrowLeft'); press('ArrowLeft'); press('ArrowLeft'); at(0.499);
            press('ArrowRight'); press('x'); press('ArrowLeft', byId('time')); press(' '); out.push(playing); return out;""")
        self.assertEqual(found, [0.0025, 0.005, 0.0025, 0, 0, 0.5, 0.5, 0.5, "kept", 0, True])

    def test_all_of_the_motion_is_in_sight_and_fills_it(self):
        found = self.ask("""const corners = () => {
                const stage = byId('stage'); camera.aspect = stage.clientWidth / stage.clientHeight; camera.updateProjectionMatrix(); camera.updateMatrixWorld(true);
                const b = current.box, most = [0, 0];
                for (const x of [b.min.x, b.max.x]) for (const y of [b.min.y, b.max.y]) for (const z of [b.min.z, b.max.z]) {
                  const p = new THREE.Vector3(x, y, z).project(camera); most[0] = Math.max(most[0], Math.abs(p.x));
                  most[1] = Math.max(most[1], Math.abs(p.y)); } return most; };
            return [corners(), current.box.min.toArray(), current.box.max.toArray(), current.across];""")
        most, low, high, across = found
        self.assertLess(max(most), 1)
        self.assertGreater(max(most), 0.8)
        # `one` goes from (0, 0, 0) to (5, 10, -15), with a box of half a diagonal and its offset about it; `two` is a hull.
        reach = math.hypot(0.1, 0.2, 0.3) + math.hypot(1, 2, 3)
        np.testing.assert_allclose([low[0], low[1], low[2]], [-reach, -reach, -15 - reach], rtol=1e-5)
        self.assertGreaterEqual(high[1], 10 + reach - 1e-5)
        self.assertAlmostEqual(across, math.dist(low, high), 4)

    def test_two_runs_stand_side_by_side_or_over_each_other_and_their_distance_is_a_curve(self):
        folders = [self.moving(), self.moving("other", shift=0.5, summary={"status": "ok"})]
        found = self.ask("""const out = []; for (const way of ['side', 'over']) { byId('mode').value = way; byId('mode').onchange(); draw();
              out.push([...byId('names').children].map(c => [c.textContent, c.style.left, c.style.top]));
              out.push(current.runs.map(r => r.root.visible), current.runs.map(r => r.planes[0].visible));
              }
            at(0.3); out.push(byId('values').textContent, byId('laid').hidden, [...byId('curve').options].map(o => o.value));
            byId('curve').value = 'kinetic_energy'; chart(); out.push(byId('values').textContent); return out;""",
                         *folders, labels=["mine", "yours"])
        side, over = found[:3], found[3:6]
        self.assertEqual([name for name, *_ in side[0]], ["mine (ray)", "yours"])
        self.assertIn("(0%", side[0][0][1])
        self.assertIn("50%", side[0][1][1])
        self.assertEqual([over[0][0][1], over[0][1][1]], ["0.6rem", "0.6rem"])
        self.assertNotEqual(over[0][0][2], over[0][1][2])
        self.assertEqual((side[1], side[2]), ([False, True], [True, True]))  # the one that was drawn last
        self.assertEqual((over[1], over[2]), ([True, True], [True, False]))
        self.assertEqual(found[6:8], ["1.5 m", False])  # 0.5 m along z a moment, three moments
        self.assertEqual(found[8][0], "error")
        self.assertEqual(found[9], "mine: 997 J   yours: 997 J")

    def test_a_run_has_one_colour_in_its_name_its_bodies_and_its_curve(self):
        found = self.ask("""byId('mode').value = 'over'; byId('mode').onchange(); draw(); chart();
            const of = (value, what) => { const e = document.createElement('i'); e.style[what] = value; document.body.append(e); return getComputedStyle(e)[what]; };
            const keys = [...document.querySelectorAll('#names .key')].map(k => getComputedStyle(k).backgroundColor);
            const bodies = current.runs.map(run => of('#' + run.nodes[0].children[0].material.color.getHexString(), 'color'));
            const curves = [...document.querySelectorAll('#chart path')].map(p => getComputedStyle(p).stroke);
            return [keys, bodies, curves, ['--a', '--b'].map(name => of(css(name), 'color'))];""",
                         self.moving(), self.moving("other", shift=0.5))
        keys, bodies, curves, wanted = found
        self.assertNotEqual(*wanted)
        self.assertEqual((keys, bodies, curves), (wanted, wanted, wanted))

    def test_a_plane_is_not_drawn_from_below(self):
        found = self.ask("return [5, -5].map(y => { camera.position.set(0, y, 0); draw(); return current.runs[0].planes[0].visible; });")
        self.assertEqual(found, [True, False])

    def test_an_address_names_scene_time_and_theme(self):
        third = self.moving("third", summary={"parameters": {"boxes": 3}})
        scenes = [view.scene_of([self.moving(), self.moving("same")]), view.scene_of([third])]
        read = """return [current.name, t, document.documentElement.dataset.theme, byId('choice').hidden, byId('scene').value, current.runs.length,
            mode(), byId('speed').value, byId('title').textContent];"""
        text = view.page(scenes)
        name = "pair boxes=16 mu=0.25 start=steady"
        self.assertEqual(browser.asked(text, read, "t=0.3&theme=dark&mode=over"),
                         [name, 0.3, "dark", False, "0", 2, "over", "1", f"{name}: Two of them"])
        self.assertEqual(browser.asked(text, read, "scene=pair%20boxes%3D3&t=9"),
                         ["pair boxes=3", 0.5, "", False, "1", 1, "one", "1", "pair boxes=3: Two of them"])
        self.assertEqual(browser.asked(text, "const s = byId('scene'); s.value = '1'; s.onchange({ target: s });" + read)[:2], ["pair boxes=3", 0])


if __name__ == "__main__":
    unittest.main()
