"""The tables of what is proved in which program, in docs/rigs.md and docs/ibl.md."""

import pathlib

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"
HEADER = ["| file | proved in | the worst of all checks |", "|---|---|---|"]


class Proofs:
    """The worst of each quantity, by page, file and program."""

    def __init__(self):
        self.worst = {}

    def add(self, page, file, program, quantity, measured, text):
        quantities = self.worst.setdefault((page, file, program), {})
        if measured >= quantities.get(quantity, (0, ""))[0]:
            quantities[quantity] = (measured, text)

    def rows(self, page):
        rows = {}
        for (of, file, program), quantities in self.worst.items():
            if of == page:
                worst = "; ".join(f"{quantity} {text}".strip() for quantity, (_, text) in quantities.items())
                rows.setdefault((program, worst), []).append(f"`{file}`")
        return [f"| {', '.join(files)} | {program} | {worst} |" for (program, worst), files in rows.items()]

    def write(self):
        for page in {page for page, _, _ in self.worst}:
            path = DOCS / f"{page}.md"
            path.write_text(with_rows(path.read_text(), self.rows(page)))


def with_rows(text, rows):
    """A page with other rows in its table of proofs."""
    lines = text.split("\n")
    start = lines.index(HEADER[0])
    end = next(i for i in range(start, len(lines)) if not lines[i].startswith("|"))
    return "\n".join(lines[:start] + HEADER + rows + lines[end:])
