"""Figure 3: displacement of the sliding box (top), its distance from the exact answer (middle), processing time (bottom).

The paper's figure shows the displacement; most models move the box alike, Newton's and an early stop of the convex
method let it go too far."""
import common
from common import np, plt

SCENE = "sliding_box"
MU, G, PUSH, MASS = 0.1, 9.8, 1.0, 1.0  # the scene's own (scenarios/sliding_box.xml)
BEGIN, END = 1.0, 5.0                   # s, of the push


def exact(t):
    """Slides at (F - mu m g)/m while pushed, then is slowed by mu g until it stands."""
    a, b = PUSH / MASS - MU * G, MU * G
    pushed = np.clip(t - BEGIN, 0, END - BEGIN)
    speed = a * (END - BEGIN)
    free = np.clip(t - END, 0, speed / b)
    return a * pushed**2 / 2 + speed * free - b * free**2 / 2


options = common.arguments()
cells = common.cells(options, SCENE)
if not cells:
    common.nothing(options, "figure03", SCENE)
    raise SystemExit
looks = common.styles(cells)
figure, (top, middle, bottom) = plt.subplots(3, 1, figsize=(7, 8.4))

time = np.linspace(0, 8, 801)
truth = top.plot(time, exact(time), color="0.75", linewidth=5, label="exact", solid_capstyle="butt", zorder=2)[0]
farthest = [exact(8.0)]
for number, (cell, look) in enumerate(zip(cells, looks)):
    t, x, z = cell.series("trajectory.csv", "t", "px", "pz")
    if len(t) == 0:
        continue
    common.curve(top, t, x - x[0], look, number, len(cells), cell.how_it_ended)
    error = np.hypot(x - x[0] - exact(t), z - z[0])
    common.curve(middle, t, np.maximum(error, 1e-16), look, number, len(cells), cell.how_it_ended)
    farthest.append(np.max(np.abs(x - x[0])))
top.set(title="displacement along the push", xlabel="time (s)", ylabel="displacement (m)")
if max(farthest) > 20 * farthest[0]:
    top.set_yscale("symlog", linthresh=2 * farthest[0])
middle.set(title="distance from the exact position (below 1e-16 m drawn at 1e-16)", xlabel="time (s)", ylabel="error (m)",
           yscale="log")
common.timing_panel(bottom, cells, looks, "processing time")
figure.tight_layout()
common.legend(figure, [truth] + common.handles(cells, looks), columns=2)
common.save(figure, options, "figure03")
