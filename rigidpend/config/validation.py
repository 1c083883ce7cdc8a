"""Complaints from a schema: pydantic's errors in plain words, each where the value was written."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, get_args

from rigidpend.config.complaints import Complaint, Place, closest, meant
from rigidpend.config.reader import Document
from rigidpend.config.schema import nested

PLAIN = {
    "model_type": "expected keys with values",
    "dict_type": "expected keys with values",
    "tuple_type": "expected a list",
    "string_type": "expected text",
    "string_pattern_mismatch": "expected a letter (A to Z, a to z), then letters, digits and _",
    "string_too_long": "expected text of at most {max_length} characters",
    "too_short": "expected at least {min_length}",
    "too_long": "expected at most {max_length} values",
    "literal_error": "expected {expected}",
}
"""Messages in plain words for pydantic's errors, by its names for them."""

OF_J3 = (
    ": J3 is 0, because M is horizontal; with another one the axis of rotation is tilted, gravity"
    " turns the body out of it, and there is no pendulum motion to start from"
)
NEVER = {"J3": OF_J3, "J3_0": OF_J3}
"""Keys that no config can have, with the reason."""


def complaints(document: Document, model: Any, errors: Iterable[Any]) -> list[Complaint]:
    """Complaints of a schema about a document."""
    given = list(errors)
    # Pydantic counts refused items as missing: a list is then "too short" only for that reason.
    within = {error["loc"][:k] for error in given for k in range(len(error["loc"]))}
    kept = [error for error in given if error["type"] != "too_short" or error["loc"] not in within]
    # Of a list that is too short, the last missing value tells how many there must be.
    last = {error["loc"][:-1]: error for error in kept if _lacks_value(error)}
    kept = [error for error in kept if not _lacks_value(error) or error in last.values()]
    return [_problem(document, model, error) for error in kept]


def among(words: Iterable[str]) -> str:
    """List of the known words, for the end of a message."""
    return f"(known: {', '.join(words)})"


def _problem(document: Document, model: Any, error: Any) -> Complaint:
    place = (*_written(document, error["loc"]), *_named(error))
    if error["type"] == "extra_forbidden":
        siblings = _fields(model, place[:-1])
        hint = NEVER.get(str(place[-1])) or meant(str(place[-1]), siblings)
        hint = hint or _elsewhere(model, str(place[-1]))
        message = f"unknown key{hint} {among(siblings)}"
        return Complaint(document.origin(place, of_key=True), place, message)
    if _lacks_value(error):
        said = f"expected {error['loc'][-1] + 1} values, got {len(error['input'])}"
        return Complaint(document.origin(place), place, said)
    if error["type"] == "missing":
        place = (*place, error["loc"][-1])
        return Complaint(document.origin(place), place, "required")
    # So pydantic marks the name that the user has given to a part.
    of_key = error["loc"][-1:] == ("[key]",)
    return Complaint(document.origin(place, of_key=of_key), place, _plain(error))


def _lacks_value(error: Any) -> bool:
    """True if a value is missing at the end of a list."""
    return error["type"] == "missing" and isinstance(error["loc"][-1], int)


def told(errors: Sequence[Any]) -> str:
    """The first of a schema's complaints about a value that no user has written, with its key."""
    first = errors[0]
    return f"{'.'.join(map(str, (*first['loc'], *_named(first))))}: {_plain(first)}"


def _named(error: Any) -> Place:
    """The field named by a condition on several fields; pydantic knows only their part."""
    field = getattr(error.get("ctx", {}).get("error"), "field", "")
    return tuple(field.split(".")) if field and isinstance(error["input"], dict) else ()


def _written(document: Document, location: Sequence[Any]) -> Place:
    """The part of a schema's location that exists in the file, without branches of unions."""
    place: Place = ()
    for part in location:
        if (*place, part) in document.values:
            place = (*place, part)
    return place


def _plain(error: Any) -> str:
    """Message of a schema in plain words, with the given value."""
    known, given = error.get("ctx", {}), error["input"]
    if "error" in known:
        return str(known["error"])
    got = f", got {given!r}" if isinstance(given, str | int) else ""
    if error["type"] == "literal_error" and isinstance(given, str):
        # Pydantic lists the allowed words in one text, each in quotes.
        got += meant(given, str(known["expected"]).split("'")[1::2])
    if error["type"] == "tuple_type" and isinstance(given, str) and "," in given:
        got += f"; write [{given.strip('()[]{} ')}]"
    if error["type"] in PLAIN:
        return PLAIN[error["type"]].format(**known) + got
    message = str(error["msg"])
    # Pydantic's sentences begin with a capital; here they continue after a place.
    return message[0].lower() + message[1:] + got


def _elsewhere(model: Any, word: str) -> str:
    """Suggest a key of another part of the config, if one is close."""
    known = {key.rpartition(".")[2]: key for key in _keys(model)}
    # Stricter than among siblings, because among all keys of a schema some always look alike.
    close = closest(word, known, 0.7)
    return f"; did you mean {known[close]}?" if close else ""


def _keys(model: Any, prefix: str = "") -> Iterator[str]:
    """Full keys of a schema's parts, deeper ones first, so that shallow ones overwrite them."""
    for name, field in getattr(model, "model_fields", {}).items():
        yield from _keys(field.annotation, f"{prefix}{name}.")
        yield f"{prefix}{name}"


def _fields(kind: Any, place: Place) -> list[str]:
    """Keys that a schema knows at a place."""
    for key in place:
        # In a mapping the user chooses the key, and the type of the values is the schema's part.
        field = getattr(kind, "model_fields", {}).get(str(key))
        kind = field.annotation if field else next(iter(get_args(kind)[1:]), None)
    return list(getattr(nested(kind)[0], "model_fields", ()))
