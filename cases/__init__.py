"""The cases, one file each; `python -m cases` lists and runs them."""
