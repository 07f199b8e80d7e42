"""``python -m tests.fuzz --scenes 0:2000 --workers 2``: run and judge fuzzed scenes."""

from tests.fuzz.batch import main

if __name__ == "__main__":
    main()
