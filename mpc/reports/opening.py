"""How a page begins: a long verdict shows its first sentences, and folds the others away."""

import re

#: Longest verdict that is shown whole, and what is shown of a longer one [characters]: eight lines, and four.
_LONGEST, _OPENING = 600, 300

#: Where a sentence ends, and another begins.
_BETWEEN = re.compile(r"(?<=[.!?]) (?=[A-Z])")


def opening(text: str) -> tuple[str, str]:
    """Part a verdict into its first sentences, which everybody reads, and the others.

    Parameters
    ----------
    text : str
        Sentences.

    Examples
    --------
    >>> opening("It fits.")
    ('It fits.', '')
    >>> opening("It fits. And more" + 100 * " of it" + ".")[0]
    'It fits.'
    """
    sentences = _BETWEEN.split(text)
    if len(text) <= _LONGEST or len(sentences) < 2:
        return text, ""
    count = max(1, sum(len(" ".join(sentences[:k])) <= _OPENING for k in range(1, len(sentences))))
    return " ".join(sentences[:count]), " ".join(sentences[count:])
