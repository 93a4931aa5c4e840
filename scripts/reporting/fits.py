"""Least squares in closed form. numpy's come from whatever LAPACK is installed, and their last digits with it: the report
made on another machine would differ."""
import math
import statistics


def slope(x, y):
    """Least squares of log y over log x."""
    return statistics.linear_regression([math.log(a) for a in x], [math.log(b) for b in y]).slope


def circle(points):
    """Radius and relative root mean square deviation of the best circle through points (x, y): algebraic least squares, after
    I. Kasa, IEEE Transactions on Instrumentation and Measurement 25 (1976). Of points on a line: nan."""
    n = len(points)
    centroid = [math.fsum(p[i] for p in points) / n for i in (0, 1)]
    u, v = ([float(p[i] - centroid[i]) for p in points] for i in (0, 1))
    w = [a * a + b * b for a, b in zip(u, v)]
    uu, uv, vv, uw, vw = (math.fsum(map(float.__mul__, a, b)) for a, b in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    determinant = 2 * (uu * vv - uv * uv)
    if not determinant > 0:
        return math.nan, math.nan
    a, b = (uw * vv - vw * uv) / determinant, (vw * uu - uw * uv) / determinant
    radius = math.sqrt(a * a + b * b + (uu + vv) / n)
    return radius, math.sqrt(math.fsum((math.hypot(x - a, y - b) - radius)**2 for x, y in zip(u, v)) / n) / radius
