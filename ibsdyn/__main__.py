"""``python -m ibsdyn`` is the command line."""

import sys

from ibsdyn.cli import main

sys.exit(main())
