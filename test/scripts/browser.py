"""A page in Debian's Chromium, without a network: what it says on its console, and what a script in it finds."""
import html
import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

CHROMIUM = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
QUIET = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-sync",
         "--disable-background-networking", "--disable-component-update", "--proxy-server=127.0.0.1:9", "--enable-logging=stderr", "--v=0"]
WHY_NOT = "chromium is not installed (apt install chromium): the page is not looked at in a browser"

# The script ends with what it returns, or with the error that it met.
ASKED = """<pre id="found_by_test"></pre><script>
(async () => { %s })().then(found => ({ found }), error => ({ error: String(error && error.stack || error) })).then(said => {
  document.getElementById("found_by_test").textContent = JSON.stringify(said);
});
</script>"""


def browse(page, *words, where=""):
    """Chromium's ended process, after it has looked at the file `page`#where."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        ended = subprocess.run([CHROMIUM, *QUIET, f"--user-data-dir={profile}", *words, page.as_uri() + (where and f"#{where}")],
                               capture_output=True, text=True, timeout=180)
    if ended.returncode != 0:
        raise AssertionError(ended.stderr)
    return ended


def faults(ended):
    """What is wrong with the page; what the software renderer says of a screenshot is no fault of it."""
    return [line for line in ended.stderr.splitlines() if "CONSOLE" in line and "GL Driver Message" not in line]


def asked(text, script, where="", size="1000,800"):
    """What the body of an async function, run at the end of the page `text`, returns."""
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        page.write_text(text.replace("</body>", "") + ASKED % script)
        ended = browse(page, f"--window-size={size}", "--virtual-time-budget=5000", "--dump-dom", where=where)
    said = re.search(r'<pre id="found_by_test">(.*?)</pre>', ended.stdout, re.S)
    if not said or not said.group(1) or faults(ended):
        raise AssertionError(f"{faults(ended)} {ended.stderr[-2000:]}")
    answer = json.loads(html.unescape(said.group(1)))
    if "error" in answer:
        raise AssertionError(answer["error"])
    return answer.get("found")
