"""`python -m hdopt`: the commands, for where no script is installed, or more than one is."""

from hdopt.cli import main

if __name__ == "__main__":
    main()
