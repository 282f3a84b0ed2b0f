"""Words of a drawing as names of its rooms: of a DXF, of a page of a PDF, and of a picture where OCR is asked for."""

import csv
import html
import io
import re
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from thermal.case.validation import RESERVED
from thermal.plan.drawing import Drawing
from thermal.plan.guard import extra, run_program
from thermal.plan.survey import FloorSurvey

_LONGEST = 60  # characters of a name
_SURE = 60.0  # of 100: confidence of a word that OCR reads; below it, strokes of walls and doors become words too
#: What stands in rooms and is no name of one: areas, lengths, heights, scales; numbers alone are names.
_MEASURE = re.compile(
    r"^[\W_]*(h\s*=\s*\d+([.,]\d+)?|[<>=~±øØ]?\s*\d+([.,]\d+)+|\d+([.,]\d+)?\s*(m|mm|cm|m2|m²|qm|sqm|sf|sq\.?\s?ft\.?|ft2?|ft²|['’\"″])|1\s*:\s*\d+)[\W_]*"
    r"(m|mm|cm|m2|m²|qm|sqm|sf|sq\.?\s?ft\.?|ft2?|ft²)?[\W_]*$",
    re.IGNORECASE,
)
_LINE = re.compile(r'<line xMin="([\d.]+)" yMin="([\d.]+)" xMax="([\d.]+)" yMax="([\d.]+)">(.*?)</line>', re.DOTALL)
_WORD = re.compile(r"<word [^>]*>(.*?)</word>", re.DOTALL)
_PROGRAM = "tesseract"
_LETTER = 100  # px: larger pieces of ink are no letters, which have up to 8 mm on paper at 300 dots per inch
_INK, _PAPER = 160, 255  # greys: ink is darker than the first


@dataclass(frozen=True)
class TextLine:
    """A line of text of a drawing.

    Parameters
    ----------
    text : str
        What it says.
    x, y : float
        Column and row of its middle [px of the drawing]; of a DXF, its own x and y.
    """

    text: str
    x: float
    y: float


def name_rooms(survey: FloorSurvey, lines: Sequence[TextLine]) -> FloorSurvey:
    """Give rooms the texts in them as names.

    Parameters
    ----------
    survey : FloorSurvey
        A floor.
    lines : sequence of TextLine
        Texts of its drawing.

    Returns
    -------
    FloorSurvey
        With names: the topmost line of a room that is no measure; all such lines of it where another room begins with
        the same one, as in "Office", "2.14".
    """
    found: dict[int, list[tuple[float, str]]] = {}
    for line in lines:
        text, label = " ".join(line.text.split())[:_LONGEST].strip(), survey.label_at((line.x, line.y))
        if label > 0 and text and text not in RESERVED and not _MEASURE.match(text):
            found.setdefault(label, []).append((survey.place((line.x, line.y))[1], text))
    texts = {label: [text for _, text in sorted(there, key=lambda entry: entry[0])] for label, there in found.items()}
    first = [there[0] for there in texts.values()]
    names = {
        label: there[0] if first.count(there[0]) == 1 else " ".join(dict.fromkeys(there))[:_LONGEST].strip()
        for label, there in texts.items()
    }
    return replace(survey, rooms=tuple(replace(room, name=names.get(room.label, "")) for room in survey.rooms))


def pdf_lines(file: Path, page: int, dots_per_inch: float) -> tuple[TextLine, ...]:
    """Read the lines of text of a page of a PDF.

    Parameters
    ----------
    file : Path
        PDF.
    page : int
        From 1.
    dots_per_inch : float
        At which its drawing is looked at [1/inch].

    Returns
    -------
    tuple of TextLine
        None of a page that was scanned.

    Raises
    ------
    PlanError
        The page cannot be read.
    MissingExtraError
        ``pdftotext`` (Debian's poppler-utils) is not installed.
    """
    command = ["pdftotext", "-f", str(page), "-l", str(page), "-bbox-layout", str(file), "-"]
    told = run_program(command, file, "a whole PDF file with that page", "poppler-utils")
    scale = dots_per_inch / 72.0  # pixels a point
    found = []
    for left, top, right, bottom, inner in _LINE.findall(told):
        text = " ".join(html.unescape(word) for word in _WORD.findall(inner))
        x, y = (float(left) + float(right)) / 2.0, (float(top) + float(bottom)) / 2.0
        found.append(TextLine(text, x * scale, y * scale))
    return tuple(found)


def can_read_pictures() -> bool:
    """Whether the program that reads words of pictures is installed."""
    return shutil.which(_PROGRAM) is not None


def picture_lines(drawing: Drawing) -> tuple[TextLine, ...]:
    """Read the lines of text of a picture by OCR.

    Parameters
    ----------
    drawing : Drawing
        In grey.

    Returns
    -------
    tuple of TextLine
        Words of at least two letters or digits that are read with a confidence of 60 % or more.

    Raises
    ------
    MissingExtraError
        ``tesseract`` (Debian's tesseract-ocr) is not installed.
    PlanError
        It fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "drawing.png"
        extra("PIL.Image").fromarray(_without_walls(drawing.grey)).save(picture)
        # Sparse text in no order: names stand apart on a plan. English letters are those of most languages of plans.
        command = [_PROGRAM, str(picture), "stdout", "--psm", "11", "tsv"]
        told = run_program(command, picture, f"{drawing.source}: a picture that can be read", "tesseract-ocr")
    lines: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for row in csv.DictReader(io.StringIO(told), delimiter="\t", quoting=csv.QUOTE_NONE):
        if (row.get("text") or "").strip() and float(row["conf"]) >= _SURE:
            lines.setdefault((row["block_num"], row["par_num"], row["line_num"]), []).append(row)
    return tuple(filter(None, (_line(words, drawing.corner) for words in lines.values())))


def _without_walls(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Leave out what hangs together over more than a letter: around it, OCR sees no text at all."""
    ink = grey < _INK
    pieces, _ = ndimage.label(ink, np.ones((3, 3)))
    kept = grey.copy()
    for number, where in enumerate(ndimage.find_objects(pieces), start=1):
        if max(part.stop - part.start for part in where) > _LETTER:
            kept[where][pieces[where] == number] = _PAPER
    return kept


def _line(words: Sequence[dict[str, str]], corner: tuple[float, float]) -> TextLine | None:
    """Make a line of the words of a row of OCR; none where they are strokes rather than words."""
    text = " ".join(word["text"].strip() for word in words)
    if sum(sign.isalnum() for sign in text) < 2:
        return None
    left = min(int(word["left"]) for word in words)
    right = max(int(word["left"]) + int(word["width"]) for word in words)
    top = min(int(word["top"]) for word in words)
    bottom = max(int(word["top"]) + int(word["height"]) for word in words)
    return TextLine(text, (left + right) / 2.0 + corner[0], (top + bottom) / 2.0 + corner[1])
