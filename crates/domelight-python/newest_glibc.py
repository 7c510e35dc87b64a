"""The newest version of glibc's symbols that an ELF file asks for; fails if it is newer than manylinux2014's."""

import re
import sys

MANYLINUX2014 = (2, 17)


def main() -> None:
    with open(sys.argv[1], "rb") as file:
        content = file.read()
    versions = {tuple(map(int, v.split(b"."))) for v in re.findall(rb"\0GLIBC_([0-9.]+)(?=\0)", content)}
    newest = max(versions, default=(0,))
    print(".".join(map(str, newest)))
    if newest > MANYLINUX2014:
        sys.exit(f"{sys.argv[1]} wants glibc {newest}, newer than manylinux2014's {MANYLINUX2014}")


if __name__ == "__main__":
    main()
