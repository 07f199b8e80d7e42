"""The documentation as a site, and the pictures of it: ``python -m website [build | picture]``."""
