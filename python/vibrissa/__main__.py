"""``python -m vibrissa``: the version, the devices, and the program, where it is installed."""

import os
import shutil
import sys

from . import __version__, devices

_PROGRAM = shutil.which("vibrissa")


def main() -> None:
    """Runs the program with the arguments, or says what this package sees."""
    if len(sys.argv) > 1:
        if _PROGRAM is None:
            sys.exit("the program vibrissa is not on PATH: cargo install vibrissa-cli; in Python, import vibrissa has its commands")
        os.execv(_PROGRAM, [_PROGRAM, *sys.argv[1:]])
    print(f"vibrissa {__version__}, {sys.executable}")
    for device in devices():
        print(device)


if __name__ == "__main__":
    main()
