"""python -m tests.frozen [ROOM ...] [--write]: see `tests.frozen`."""

import argparse
import sys

from . import ROOMS, Room, __doc__, compare

parser = argparse.ArgumentParser(
    "python -m tests.frozen", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
)
parser.add_argument("rooms", nargs="*", metavar="ROOM", help=", ".join(ROOMS) + " (all)")
parser.add_argument("--write", action="store_true", help="write the files")
arguments = parser.parse_args()
rooms = arguments.rooms or ROOMS
if unknown := set(rooms) - set(ROOMS):
    parser.error(f"no room {', '.join(sorted(unknown))}: there are {', '.join(ROOMS)}")
if arguments.write:
    for room in rooms:
        Room(room).write()
else:
    sys.exit(not compare(rooms))
