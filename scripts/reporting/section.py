"""What a section of the report is, and the little HTML that sections share."""
import base64
import html
from dataclasses import dataclass, field


@dataclass
class Section:
    html: str
    data: dict = field(default_factory=dict)    # for report.json: the same whenever the same is run
    timing: dict = field(default_factory=dict)  # for report.json: what depends on the machine and its moods


def esc(text):
    return html.escape(str(text))


def picture(path, alt):
    """An image inside the file, so that the report needs nothing else."""
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<img alt="{esc(alt)}" src="data:image/png;base64,{data}">'


def code(lines, summary):
    """Commands behind a line that opens them."""
    return f"<details><summary>{esc(summary)}</summary><pre>{esc(chr(10).join(lines))}</pre></details>" if lines else ""


def table(head, rows, classes=None):
    """Rows of cells, already HTML; a class for each row where given."""
    lines = ['<div class="wide"><table><thead><tr>' + "".join(f"<th>{h}</th>" for h in head) + "</tr></thead><tbody>"]
    for number, row in enumerate(rows):
        kind = f' class="{classes[number]}"' if classes and classes[number] else ""
        lines.append(f"<tr{kind}>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>")
    return "\n".join(lines + ["</tbody></table></div>"])
