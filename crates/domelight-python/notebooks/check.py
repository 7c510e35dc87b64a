"""Runs notebooks and looks at what they show: check.py [--write=FOLDER] NOTEBOOK..."""

import pathlib
import sys

import nbformat
from nbclient import NotebookClient


def check(path: pathlib.Path, folder: pathlib.Path | None) -> None:
    notebook = nbformat.read(path, as_version=4)
    kept = [i for i, cell in enumerate(notebook.cells) if cell.cell_type == "code" and cell.outputs]
    if kept:
        sys.exit(f"{path}: the outputs of cells {kept} are stored; clear them")
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    shown = [output for cell in code for output in cell.outputs]
    pictures = sum("image/png" in output.get("data", {}) for output in shown)
    errors = [output for output in shown if output.get("name") == "stderr"]
    if errors:
        sys.exit(f"{path}: it warns: {errors[0]['text']}")
    if pictures < 2:
        sys.exit(f"{path}: it shows {pictures} pictures")
    print(f"{path.name}: {len(code)} cells, {pictures} pictures")
    if folder is not None:
        nbformat.write(notebook, folder / path.name)


def main() -> None:
    folder = None
    for argument in sys.argv[1:]:
        if argument.startswith("--write="):
            folder = pathlib.Path(argument.removeprefix("--write="))
            folder.mkdir(parents=True, exist_ok=True)
        else:
            check(pathlib.Path(argument), folder)


if __name__ == "__main__":
    main()
