"""Puts the sources of all crates into an unpacked source distribution, so that it builds without a network:
python vendor.py FOLDER. Needs cargo, and a network or cargo's cache.

Of crates that neither Linux nor macOS needs only the manifest stays, which cargo reads when it resolves versions.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys

TARGETS = [
    f"{processor}-{system}"
    for processor in ("x86_64", "aarch64")
    for system in ("unknown-linux-gnu", "unknown-linux-musl", "apple-darwin")
]

CONFIG = """[source.crates-io]
replace-with = "vendored-sources"

[source.vendored-sources]
directory = "vendor"
"""


def needed(package: pathlib.Path) -> set[tuple[str, str]]:
    """Name and version of all crates that a build for one of the targets compiles."""
    found = set()
    for target in TARGETS:
        command = ["cargo", "tree", "--locked", "-e", "normal,build", "--prefix", "none", "--format", "{p}"]
        lines = subprocess.check_output([*command, "--target", target], cwd=package, text=True).splitlines()
        # Such as `libc v0.2.1`, or `paste v1.0.0 (proc-macro)`.
        found |= {(name, version.removeprefix("v")) for name, version, *_ in map(str.split, filter(None, lines))}
    return found


def reduce_to_manifest(crate: pathlib.Path) -> None:
    """Leaves a crate's manifest, and nothing in its targets."""
    for path in sorted(crate.rglob("*"), reverse=True):
        if path.is_dir():
            if not any(path.iterdir()):
                path.rmdir()
        elif path.suffix == ".rs":
            path.write_text("")
        elif path.name not in ("Cargo.toml", ".cargo-checksum.json"):
            path.unlink()


def main(root: pathlib.Path) -> None:
    package, vendor = root / "domelight-python", root / "vendor"
    shutil.rmtree(vendor, ignore_errors=True)
    subprocess.run(["cargo", "vendor", "--quiet", "--locked", str(vendor.resolve())], cwd=package, check=True,
                   stdout=subprocess.DEVNULL)
    wanted = needed(package)
    for crate in sorted(vendor.iterdir()):
        manifest = (crate / "Cargo.toml").read_text().split("[package]", 1)[1].split("\n[", 1)[0]
        name, version = (re.search(rf'^{key} = "(.*)"', manifest, re.MULTILINE)[1] for key in ("name", "version"))
        if (name, version) not in wanted:
            reduce_to_manifest(crate)
            checksum = crate / ".cargo-checksum.json"
            checksum.write_text(json.dumps({**json.loads(checksum.read_text()), "files": {}}))
    (root / ".cargo").mkdir(exist_ok=True)
    (root / ".cargo" / "config.toml").write_text(CONFIG)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
