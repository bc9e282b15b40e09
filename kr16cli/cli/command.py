"""A typer command that takes negative numbers as values and names mistyped options.

Before typer parses, the arguments are sorted: options with their values first, then `--`, then
the rest. An option whose metavar has several words takes that many numbers (words in brackets
are optional): `--tool "X Y Z A B C"`, `--payload "M X Y Z [IX IY IZ]"`. Its value may also be
one text: `"1,2,3"` or KRL in braces.
"""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from kr16cli.errors import InputError


def new_app(**settings: Any) -> typer.Typer:
    """A typer app for one command or group of commands of `kr16`."""
    options: dict[str, Any] = {
        "add_completion": False,
        "rich_markup_mode": None,
        "pretty_exceptions_enable": False,
        "context_settings": {"help_option_names": ["-h", "--help"]},
    }
    return typer.Typer(**(options | settings))


def is_number(text: str) -> bool:
    """Whether a word is a number, nan and infinity included (refused later, by name)."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def unknown(kind: str, word: str, known: list[str]) -> InputError:
    """The error for a mistyped option or command, with the nearest right one."""
    matches = get_close_matches(word, known, n=1)
    hint = f"did you mean {matches[0]}?" if matches else f"known: {', '.join(sorted(known))}"
    return InputError(f"unknown {kind} {word}; {hint}")


class _AsTyped:
    """Stands in for typer's pydantic coercion where a value is text: nothing to coerce.

    Importing pydantic costs more than everything else a single query does. An option with an
    empty text, as a shell makes of an unset variable, is no option left out: InputError.
    """

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        option = param.param_type_name == "option" and not ctx.resilient_parsing
        if option and isinstance(value, str) and not value.strip():
            raise InputError(f"{param.opts[0]} is empty; it needs {param.metavar or 'a value'}")
        return () if value is None and (param.multiple or param.nargs == -1) else value


def _no_type(ctx: Any) -> None:
    return None


class _Lean:
    """Mixin of commands and groups: parameters of type str and bool are taken as typed."""

    help: str | None

    def get_params(self, ctx: Any) -> Any:
        params = super().get_params(ctx)  # type: ignore[misc]
        for param in params:
            described = getattr(param, "type_descriptor", None)
            if getattr(described, "annotation", None) in (str, bool, list[str]):
                param._runtime_param = _AsTyped()
            if param.param_type_name == "argument":
                param.display_type_rich = _no_type  # the metavar says what is wanted
        return params

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """A plain help page; some versions of typer draw boxes whatever they are told."""
        for part in ("usage", "help_text", "options", "epilog"):
            getattr(self, f"format_{part}")(ctx, formatter)

    def format_help_text(self, ctx: Any, formatter: Any) -> None:
        """The help text, with paragraphs of `$ kr16 ...` examples kept line by line."""
        paragraphs = (self.help or "").split("\n\n")
        self.help = "\n\n".join(f"\b\n{p}" if p.startswith("$ ") else p for p in paragraphs)
        super().format_help_text(ctx, formatter)  # type: ignore[misc]


class LeanGroup(_Lean, TyperGroup):
    """A group of commands without costly start-up, which names its commands to the mistyped."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the first word names."""
        word = args[0]
        known = ctx.resilient_parsing or self.get_command(ctx, word) is not None
        if not known and not word.startswith("-"):
            raise unknown(f"{ctx.info_name} command", word, self.list_commands(ctx))
        return super().resolve_command(ctx, args)


class Command(_Lean, TyperCommand):
    """A command of `kr16`; see the module's text for how it reads its arguments."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Sort the arguments, then let typer parse them."""
        if not ctx.resilient_parsing and not {"-h", "--help"} & set(args):
            args = _Sorter(self.get_params(ctx)).sort(args)
        return super().parse_args(ctx, args)


class _Sorter:
    """Splits arguments into options with values and the rest."""

    def __init__(self, params: list[Any]) -> None:
        self.options = {
            name: param
            for param in params
            if param.param_type_name == "option"
            for name in (*param.opts, *param.secondary_opts)
        }

    def sort(self, args: list[str]) -> list[str]:
        options: list[str] = []
        others: list[str] = []
        rest = list(args)
        while rest:
            word = rest.pop(0)
            if word == "--":
                others += rest
                break
            if not self.is_option(word):
                others.append(word)
                continue
            name, joined, value = self.split(word)
            param = self.options.get(name)
            if param is None:
                raise unknown("option", name, list(self.options))
            if param.is_flag:
                if joined:
                    raise InputError(f"{name} takes no value, got {value!r}")
                options.append(name)
                continue
            if not joined:
                value = self.value(name, param, rest, len(others))
            options += [name, value]
        return [*options, "--", *others]

    @staticmethod
    def is_option(word: str) -> bool:
        """A word with a dash that is no number, list or range of numbers, or the dash of stdin."""
        head = word.replace(";", ",").replace(":", ",").split(",")[0].split()
        return word.startswith("-") and word != "-" and bool(head) and not is_number(head[0])

    @staticmethod
    def split(word: str) -> tuple[str, bool, str]:
        """Name of an option, whether a value is joined to it, and that value."""
        if word.startswith("--"):
            name, joined, value = word.partition("=")
            return name, bool(joined), value
        return word[:2], len(word) > 2, word[2:]

    def value(self, name: str, param: Any, rest: list[str], before: int) -> str:
        """Take the option's value from the words that follow it."""
        words = (param.metavar or "").split()
        least = next((i for i, w in enumerate(words) if w.startswith("[")), len(words))
        if not rest or self.is_option(rest[0]):
            raise InputError(f"{name} needs {param.metavar or 'a value'}")
        if len(words) < 2 or not is_number(rest[0]):
            if len(words) > 1:
                self.decimal_commas(name, param.metavar, rest, (least, len(words)))
            return rest.pop(0)
        run = next((i for i, w in enumerate(rest) if not is_number(w)), len(rest))
        # An optional tail is there if the numbers that would be left over make sense without it:
        # none at all, or the six of the command itself.
        long = len(words)
        takes = long if run in (long, long + 6) or (run > long and before) else least
        if run < takes or (run != takes and least != long and run < long):
            what = f"{least} or {long}" if least != long else f"{least}"
            raise InputError(f"{name} takes {what} numbers ({param.metavar}), got {run}")
        taken, rest[:] = rest[:takes], rest[takes:]
        return " ".join(taken)

    @staticmethod
    def decimal_commas(name: str, metavar: str, rest: list[str], takes: tuple[int, int]) -> None:
        """InputError for words like `1,5 2 3`, which are too few or too many numbers."""
        parts = [word.split(",") for word in rest[: takes[1]]]
        run = next((i for i, p in enumerate(parts) if not all(map(is_number, p))), len(parts))
        count, shown = sum(map(len, parts[:run])), " ".join(rest[:run])
        if run < 2 or len(parts[0]) in takes or count in takes:
            return
        what = " or ".join(map(str, dict.fromkeys(takes)))
        raise InputError(
            f"{name} takes {what} numbers ({metavar}), got {count} in '{shown}'; a comma parts "
            "numbers, a decimal has a point"
        )
