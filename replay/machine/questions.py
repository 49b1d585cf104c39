"""Questions that a drafted machine file puts to its reader."""

from pathlib import Path

#: How the comment of a question begins.
QUESTION = "QUESTION: "


def open_questions(file: Path) -> int:
    """How many questions of a machine file nobody has answered yet, by removing them; 0 where it cannot be read.

    Parameters
    ----------
    file : Path
        Machine file.
    """
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return 0
    return sum(line.startswith(f"# {QUESTION}") for line in lines)
