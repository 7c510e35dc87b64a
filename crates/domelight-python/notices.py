"""Writes the notices of all crates that the wheel contains: name, version, license, and each license text once.

    notices.py FILE [MANIFEST CRATE]

With a manifest, those of a crate of its own.
"""

import json
import pathlib
import subprocess
import sys

FOLDER = pathlib.Path(__file__).parent
NAMES = ("LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE", "COPYRIGHT")


def packages(manifest: pathlib.Path, root: str) -> dict[str, dict]:
    """The packages that a root depends on at run time, itself excluded, by their ids."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--manifest-path", str(manifest)]
    metadata = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    by_id = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    start = next(package["id"] for package in metadata["packages"] if package["name"] == root)
    found, queue = {}, [start]
    while queue:
        for dependency in nodes[queue.pop()]["deps"]:
            is_linked = any(kind["kind"] is None for kind in dependency["dep_kinds"])
            if is_linked and dependency["pkg"] not in found:
                found[dependency["pkg"]] = by_id[dependency["pkg"]]
                queue.append(dependency["pkg"])
    return {key: package for key, package in found.items() if package["source"] is not None}


def texts(package: dict) -> list[str]:
    """The license texts in a package's folder."""
    folder = pathlib.Path(package["manifest_path"]).parent
    files = [f for f in folder.iterdir() if f.is_file() and f.name.upper().startswith(NAMES)]
    return [file.read_text(encoding="utf-8", errors="replace").strip() for file in sorted(files)]


def text(roots: list[tuple[pathlib.Path, str]]) -> str:
    """The notices of all packages that the roots, each of a manifest, depend on."""
    found: dict[tuple[str, str], dict] = {}
    for manifest, root in roots:
        for package in packages(manifest, root).values():
            found[(package["name"], package["version"])] = package
    lines = ["This software contains the following packages.", ""]
    by_text: dict[str, list[str]] = {}
    for (name, version), package in sorted(found.items()):
        lines.append(f"{name} {version}: {package['license'] or 'see its text'}")
        for license_text in texts(package):
            by_text.setdefault(license_text, []).append(f"{name} {version}")
    for license_text, names in sorted(by_text.items(), key=lambda item: item[1]):
        lines += ["", "-" * 80, ", ".join(names), "", license_text]
    return "\n".join(lines) + "\n"


def main() -> None:
    if len(sys.argv) > 2:
        manifest, root = sys.argv[2:]
        pathlib.Path(sys.argv[1]).write_text(text([(pathlib.Path(manifest), root)]), encoding="utf-8")
        return
    roots = [(FOLDER / "Cargo.toml", "domelight-python")]
    program = FOLDER / "../../Cargo.toml"
    # A source distribution has no program.
    if (FOLDER / "../domelight-cli/Cargo.toml").exists():
        roots.append((program, "domelight-cli"))
    pathlib.Path(sys.argv[1]).write_text(text(roots), encoding="utf-8")


if __name__ == "__main__":
    main()
