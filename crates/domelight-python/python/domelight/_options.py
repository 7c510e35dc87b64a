"""Options of jobs as keywords: names, defaults and texts are the engine's, the same as on the command line."""

from __future__ import annotations

import functools
import inspect
import json
import textwrap
from collections.abc import Callable
from typing import Any, Literal, TypedDict, TypeVar, cast, get_args, get_origin, get_type_hints

from . import _domelight
from ._names import Filter, Passes, Sampler


class PictureOptions(TypedDict, total=False):
    """The types of what pictures have, for type checkers."""

    size: tuple[int, int]
    hide_env: bool
    sampler: Sampler
    filter: Filter
    seed: int


class RenderOptions(PictureOptions, total=False):
    """The types of what renders have beside it."""

    spp: int
    adaptive: bool
    find_portals: bool
    passes: Passes
    target_error: float | None


PICTURE = ("view.size", "subject.hide_env", "pixel")
"""The fields and sections of a job that describe a picture of a scene in memory."""

RENDER = (*PICTURE, "sampling")
"""The fields and sections of a job that describe a render of it."""

_Function = TypeVar("_Function", bound=Callable[..., Any])


def takes(fields: tuple[str, ...], **defaults: Any) -> Callable[[_Function], _Function]:
    """Give a function the options of these fields and sections of a job, with these defaults instead of the job's.

    A line `**options` in its docstring stands for their descriptions, and `**options` in a line for their names.
    """

    def decorate(function: _Function) -> _Function:
        signature = inspect.signature(function)
        *own, rest = signature.parameters.values()
        options = {
            option["name"]: {**option, "default": defaults.get(option["name"], default(option))}
            for option in json.loads(_domelight.job_options())
            if {option["field"], option["field"].partition(".")[0]} & set(fields) and option["name"] not in signature.parameters
        }

        @functools.wraps(function)
        def taking(*arguments: Any, **keywords: Any) -> Any:
            for name in keywords:
                if name not in options and name not in signature.parameters:
                    raise TypeError(f"{function.__name__}() has no argument '{name}'")
            return function(*arguments, **{**defaults, **keywords})

        types = get_type_hints(RenderOptions)
        added = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=option["default"], annotation=types.get(name, rest.empty)
            )
            for name, option in options.items()
        ]
        positional = [parameter for parameter in own if parameter.kind is not parameter.KEYWORD_ONLY]
        taking.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[*positional, *added, *own[len(positional) :]]
        )
        taking.__doc__ = documented(function.__doc__ or "", options)
        return cast(_Function, taking)

    return decorate


def default(option: dict[str, Any]) -> Any:
    """The default as Python writes it."""
    value = option["default"]
    return tuple(map(int, value.split("x"))) if option["field"] == "view.size" else value


def documented(doc: str, options: dict[str, dict[str, Any]]) -> str:
    """A docstring with the options in their places."""
    lines: list[str] = []
    for line in doc.splitlines():
        if line.strip() == "**options":
            indent = line[: len(line) - len(line.lstrip())]
            entries = [entry(option) for option in options.values()]
            lines.append(textwrap.indent("\n".join(entries), indent))
        else:
            lines.append(line.replace("**options", ", ".join(options)))
    return "\n".join(lines)


def entry(option: dict[str, Any]) -> str:
    """The description of an option as a parameter."""
    hint = get_type_hints(RenderOptions).get(option["name"], object)
    default = "optional" if option["default"] is None else f"default {option['default']!r}"
    text = textwrap.fill(option["help"] + ".", 108, initial_indent="    ", subsequent_indent="    ")
    return f"{option['name']} : {kind(hint)}, {default}\n{text}"


def kind(hint: Any) -> str:
    """A type in a description."""
    arguments = get_args(hint)
    if get_origin(hint) is Literal:
        return f"{{{', '.join(map(repr, arguments))}}}"
    if get_origin(hint) is tuple:
        return f"({', '.join(map(kind, arguments))})"
    return kind(arguments[0]) if arguments else str(hint.__name__)
