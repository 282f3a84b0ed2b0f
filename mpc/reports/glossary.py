"""Glossary of a page: of the words that readers may not know, those that stand on it."""

import re
from functools import cache
from html import unescape
from importlib.resources import files

import yaml

_HIDDEN = re.compile(r"<(style|script|head)\b.*?</\1>|<[^>]*>", re.DOTALL)


@cache
def _terms() -> tuple[tuple[str, re.Pattern[str], str], ...]:
    listed = yaml.safe_load(files("mpc.reports").joinpath("templates/glossary.yaml").read_text(encoding="utf-8"))
    return tuple((term, re.compile(pattern), meaning) for term, pattern, meaning in listed)


def words_on(page: str) -> list[tuple[str, str]]:
    """List the words of the glossary that stand on a page, with what they mean, in alphabetical order.

    Parameters
    ----------
    page : str
        HTML.

    Examples
    --------
    >>> words_on("<p>Bias and <i>bias</i>.</p>")[0][0]
    'bias'
    """
    text = " ".join(unescape(_HIDDEN.sub(" ", page)).split())
    return sorted((term, meaning) for term, pattern, meaning in _terms() if pattern.search(text))
