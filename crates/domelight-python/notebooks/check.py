"""Runs notebooks, looks at what they show, and interrupts one: check.py [--write=FOLDER] NOTEBOOK..."""

import asyncio
import pathlib
import sys
import threading
import time

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

INTERRUPTED = """
import domelight as dl
scene, env = dl.Scene.builtin("statue"), dl.Environment.builtin("sky")
print("ready", flush=True)
try:
    dl.render(scene, env, spp=1 << 20)
except dl.RenderInterrupted as stopped:
    film = stopped.film
film
"""


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


def check_interrupt() -> None:
    """The kernel's interrupt ends a render, and the cell goes on with its film."""
    cell = nbformat.v4.new_code_cell(INTERRUPTED)
    client = NotebookClient(nbformat.v4.new_notebook(cells=[cell]), timeout=120, kernel_name="python3")
    interrupted: list[float] = []

    def interrupt() -> None:
        # The render has begun a moment after the cell says that it does.
        while not any(output.get("text", "").startswith("ready") for output in cell.get("outputs", [])):
            time.sleep(0.05)
        time.sleep(1.0)
        interrupted.append(time.monotonic())
        asyncio.run(client.km.interrupt_kernel())

    thread = threading.Thread(target=interrupt, daemon=True)
    thread.start()
    try:
        client.execute()
    except CellExecutionError as error:
        sys.exit(f"the interrupted cell fails: {error}")
    seconds = time.monotonic() - interrupted[0]
    if not any("image/png" in output.get("data", {}) for output in cell.outputs):
        sys.exit(f"the interrupted cell shows no film: {cell.outputs}")
    print(f"interrupt of a kernel: the cell had ended {seconds:.2f} s later")


def main() -> None:
    folder = None
    for argument in sys.argv[1:]:
        if argument.startswith("--write="):
            folder = pathlib.Path(argument.removeprefix("--write="))
            folder.mkdir(parents=True, exist_ok=True)
        else:
            check(pathlib.Path(argument), folder)
    check_interrupt()


if __name__ == "__main__":
    main()
