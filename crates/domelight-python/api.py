"""Writes the manual's page docs/python-api.md from the docstrings of the installed package: api.py [--check]

With --check nothing is written, and the script fails if the page is not what it would write.
"""

from __future__ import annotations

import inspect
import pathlib
import re
import sys

import domelight as dl

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "python-api.md"

SECTIONS = {
    "Rendering": ["render", "progressive", "Film", "Progressive"],
    "Scenes": ["Scene", "Camera", "Material", "Bsdf"],
    "Light": ["Environment", "Density", "shader_code", "lights", "Rig", "prefilter", "PrefilteredLight"],
    "Strategies": ["strategy_names", "strategy", "ShadingPoints", "strategies"],
    "Comparing and inspecting": ["compare", "Comparison", "inspect", "Inspection"],
    "Pictures": ["read", "write", "tone_map", "metrics"],
    "Proofs": ["testing"],
    "Warnings and interruptions": ["DomelightWarning", "RenderInterrupted"],
}

INTRO = """# Python reference

All classes and functions of the [package](python.md), from their docstrings. `crates/domelight-python/api.py` writes this
page.
"""


def entries(name: str) -> list[tuple[str, object]]:
    """What a name of the package stands for: itself, or the names of a module."""
    found = getattr(dl, name)
    if not inspect.ismodule(found):
        return [(name, found)]
    return [(f"{name}.{member}", getattr(found, member)) for member in found.__all__ if is_documented(getattr(found, member))]


def is_documented(found: object) -> bool:
    """Classes and functions are, types of annotations are not."""
    return inspect.isclass(found) or inspect.isroutine(found)


def anchors(names: list[str]) -> dict[str, str]:
    """The links to headings, of which the second of the same letters gets a number."""
    found: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^a-z0-9_-]", "", name.lower())
        taken = sum(re.fullmatch(rf"{plain}(-\d+)?", other) is not None for other in found.values())
        found[name] = f"{plain}-{taken}" if taken else plain
    return found


def signature(name: str, found: object) -> str:
    """How it is called, without types; empty if it is not called by users."""
    if inspect.isclass(found) and ("__new__" not in vars(found) and "__init__" not in vars(found) or issubclass(found, BaseException)):
        return ""
    try:
        parameters = list(inspect.signature(found).parameters.values())  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return ""
    kept = [p.replace(annotation=inspect.Parameter.empty) for p in parameters if p.name not in ("self", "cls", "slf")]
    text = str(inspect.Signature([p for p in kept if p.name != "_"]))
    if len(name) + len(text) > 100:
        text = text.replace("(", "(\n    ", 1).replace(", *,", ",\n    *,", 1)
        text = "\n".join(wrapped(line) for line in text.split("\n"))
    return f"```python\n{name}{text}\n```\n"


def wrapped(line: str) -> str:
    """A line of arguments in lines of 100 characters at most."""
    lines = [""]
    for part in re.split(r"(?<=, )(?=[a-z*])", line.strip()):
        if lines[-1] and len(lines[-1]) + len(part) > 96:
            lines.append("")
        lines[-1] += part
    indent = "    " if line.startswith("    ") else ""
    return "\n".join(indent + text.rstrip() for text in lines)


def sections(doc: str) -> list[tuple[str, list[str]]]:
    """A NumPy-style docstring's sections: headings and lines; the first has none."""
    found: list[tuple[str, list[str]]] = [("", [])]
    lines = inspect.cleandoc(doc).splitlines()
    for i, line in enumerate(lines):
        is_rule = bool(line) and set(line) == {"-"} and i > 0 and len(line) == len(lines[i - 1])
        if is_rule:
            found[-1][1].pop()
            found.append((lines[i - 1], []))
        else:
            found[-1][1].append(line)
    return found


def table(lines: list[str]) -> list[str]:
    """A simple table of reStructuredText as one of Markdown."""
    columns = [match.span() for match in re.finditer("=+", lines[0])]
    columns[-1] = (columns[-1][0], 1000)
    rows = [[line[start:end].strip() for start, end in columns] for line in lines[1:] if not line.startswith("=")]
    cells = ["| " + " | ".join(row) + " |" for row in rows]
    return [cells[0], "|" + "---|" * len(columns), *cells[1:]]


def prose(lines: list[str]) -> str:
    """Paragraphs, tables and examples."""
    out: list[str] = []
    i = 0
    while i < len(lines):
        first = i
        if re.fullmatch("=+( +=+)+", lines[i]):
            rules = [k for k in range(i, len(lines)) if lines[k].startswith("=")]
            i = rules[2] + 1
            out += table(lines[first:i])
        elif lines[i].startswith(">>>"):
            while i < len(lines) and lines[i]:
                i += 1
            out += ["```python", *lines[first:i], "```"]
        else:
            out.append(lines[i])
            i += 1
    return "\n".join(out).strip()


def items(lines: list[str]) -> str:
    """A list of parameters, results or exceptions."""
    found: list[tuple[str, list[str]]] = []
    for line in filter(None, lines):
        if line.startswith(" "):
            found[-1][1].append(line.strip())
            continue
        name, _, kind = line.partition(" : ")
        if re.fullmatch(r"\w+(, \w+)*", name):
            name = f"`{name}`"
        found.append((f"{name} ({kind})" if kind else name, []))
    return "\n".join(f"- {head}" + (f": {' '.join(text)}" if text else "") for head, text in found)


def markdown(doc: str) -> str:
    """A docstring as Markdown."""
    parts = []
    for heading, lines in sections(doc):
        if heading == "":
            parts.append(prose(lines))
        elif heading in ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns"):
            parts.append(f"**{heading}**\n\n{items(lines)}")
        else:
            parts.append(f"**{heading}**\n\n{prose(lines)}")
    return "\n\n".join(part for part in parts if part) + "\n"


def members(name: str, found: type) -> str:
    """The properties and methods of a class that people use."""
    properties, methods = [], []
    # Rust gives them in the order of its linker.
    for member, value in sorted(vars(found).items()):
        doc = inspect.getdoc(getattr(found, member, None)) or ""
        if member.startswith("_") or not doc:
            continue
        if inspect.isgetsetdescriptor(value) or isinstance(value, property):
            properties.append(f"- `{member}`: {' '.join(doc.split())}")
        elif inspect.isroutine(value):
            called = signature(f"{name}.{member}", getattr(found, member))
            methods.append(f"#### {name}.{member}\n\n{called}\n{markdown(doc)}")
    text = ""
    if properties:
        text += "**Properties**\n\n" + "\n".join(properties) + "\n\n"
    return text + "\n".join(methods)


def entry(name: str, found: object) -> str:
    doc = inspect.getdoc(found)
    if not doc:
        sys.exit(f"api: {name} has no docstring")
    text = f"### {name}\n\n{signature(name, found)}\n{markdown(doc)}"
    if inspect.isclass(found):
        text += "\n" + members(name, found)
    return text


def page() -> str:
    named = {name for names in SECTIONS.values() for name in names}
    missing = set(dl.__all__) - named - {"__version__"}
    if missing:
        sys.exit(f"api: SECTIONS lacks {', '.join(sorted(missing))}")
    listed = {title: [one for name in names for one, _ in entries(name)] for title, names in SECTIONS.items()}
    links = anchors([name for names in listed.values() for name in names])
    parts = [INTRO]
    for title, names in listed.items():
        parts.append(f"- {title}: " + ", ".join(f"[`{name}`](#{links[name]})" for name in names))
    for title, names in SECTIONS.items():
        parts.append(f"\n## {title}\n")
        for name in names:
            module = getattr(dl, name)
            if inspect.ismodule(module):
                parts.append(markdown(inspect.getdoc(module) or ""))
            parts += [entry(*one) for one in entries(name)]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts)).strip() + "\n"


def main() -> None:
    written = page()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(written, encoding="utf-8")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != written:
        sys.exit(f"api: {PAGE} is not current: run crates/domelight-python/api.py where the package is installed")


if __name__ == "__main__":
    main()
