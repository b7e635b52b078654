"""`python -m jaxbiped`: the command line."""

import sys

from jaxbiped.cli import main

if __name__ == "__main__":
    sys.exit(main())
