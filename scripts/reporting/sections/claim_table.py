"""The paper's claims and their answers."""
from .. import claims
from ..section import Section, code, esc, table

TITLE = "The paper's claims"
KIND = {claims.YES: "good", claims.NO: "bad", claims.UNKNOWN: "open"}


def verdict(text):
    return f'<span class="verdict {KIND[text]}">{esc(text)}</span>'


def answer(claim):
    """The same answer for both variants of Newton's model is said once."""
    answers = {"": next(iter(claim.answers.values()))} if len(set(claim.answers.values())) == 1 else claim.answers
    held = sum(p.verdict == claims.YES for p in claim.parts)
    return "; ".join((f"{esc(who)}: " if who else "") + verdict(what) for who, what in answers.items()) + \
        f" <small>({held} of {len(claim.parts)} parts)</small>"


def build(results):
    answers = claims.all_claims(results)
    lines = ["<p>Each claim is cut into parts that a number decides; it is reproduced when all of them are. A modern, correct "
             "implementation may contradict a claim; that is a finding. <code>scripts/claims.py C3</code> prints the numbers and the "
             "commands that repeat them.</p>"]
    lines.append(table(["", "scene", "the paper", "here"], [
        [f'<a href="#{c.id}">{c.id}</a>', esc(c.scene), esc(c.text), answer(c)] for c in answers]))
    data, timing = {}, {}
    for claim in answers:
        fixed, moving = claims.as_data(claim)
        data[claim.id] = fixed
        if moving:
            timing[claim.id] = moving
        lines.append(f'<section class="claim" id="{claim.id}"><h3>{claim.id} ({esc(claim.scene)})</h3><p><i>{esc(claim.text)}</i></p>'
                     f"<p>{answer(claim)}</p><ul>")
        for part in claim.parts:
            numbers = "; ".join(f"{esc(k)}: <b>{esc(claims.said(v))}</b>" for k, v in part.numbers.items())
            why = f" <br>Why: {esc(part.why)}." if part.why else ""
            lines.append(f"<li>{verdict(part.verdict)} {esc(part.text)}." + (f"<br><small>{numbers}</small>" if numbers else "") + f"{why}</li>")
        lines.append("</ul>" + code([f"scripts/claims.py {claim.id}"] + claims.commands(claim), "commands that repeat the numbers") + "</section>")
    return Section("\n".join(lines), data, timing)
