"""``python -m opspace`` is the command ``opspace``."""

from opspace.cli import main

if __name__ == "__main__":
    main()
