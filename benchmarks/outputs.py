# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Files with results: whole, or as they were before."""

import contextlib
import csv
import os


@contextlib.contextmanager
def replacing(path):
    """Gives the name of a new file beside `path`, of the same kind, which takes its
    place if the block ends well. If not, or if an interrupt or a full disk ends it,
    `path` is as it was, and nothing is left."""
    if path.startswith(("/dev/", "/proc/")):  # what is open already
        yield path
        return
    path = os.path.realpath(path)
    stem, suffix = os.path.splitext(path)
    new = f"{stem}.{os.getpid()}{suffix}"
    try:
        yield new
        os.replace(new, path)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(new)


def write_text(path, text):
    with replacing(path) as new, open(new, "w", encoding="utf-8") as file:
        file.write(text)


def write_csv(path, rows, columns=None):
    """Writes dictionaries; columns are the keys of the first one, if not said."""
    with replacing(path) as new, open(new, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns or list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def save_figure(figure, path, **options):
    """Matplotlib's formats, by the end of the path's name."""
    if path.endswith(".svg"):
        options = {"metadata": {"Date": None}, **options}
    with replacing(path) as new:
        figure.savefig(new, **options)
